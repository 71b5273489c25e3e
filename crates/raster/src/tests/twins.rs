//! Rust and WGSL: what is uploaded fits what is read, and models give the same values on the device as here.

use bytemuck::{Pod, Zeroable, cast_slice};
use fiber::shader::{self, Parameters};
use naga::TypeInner;
use wgpu::util::DeviceExt as _;

use super::gpu;
use crate::gpu::Gpu;
use crate::view::View;

#[path = "../../../fiber/tests/families/mod.rs"]
mod families;

use families::{CASES, Case, FAR_CASES, Question};

/// Size and members with their offsets of a structure of a shader, in bytes.
pub(super) fn layout(text: &str, name: &str) -> (usize, Vec<(String, usize)>) {
    let module = naga::front::wgsl::parse_str(text).unwrap_or_else(|error| panic!("{}", error.emit_to_string(text)));
    let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name));
    let (_, ty) = found.unwrap_or_else(|| panic!("the shader has no structure {name}"));
    let TypeInner::Struct { members, span } = &ty.inner else { panic!("{name} is no structure") };
    let members = members.iter().map(|member| (member.name.clone().unwrap_or_default(), member.offset as usize));
    (*span as usize, members.collect())
}

macro_rules! assert_twins {
    ($text:expr, $type:ident { $($member:ident),* $(,)? }) => {
        let here = vec![$((stringify!($member).to_owned(), std::mem::offset_of!($type, $member)),)*];
        assert_eq!(
            layout($text, stringify!($type)),
            (size_of::<$type>(), here),
            "{}: left is the shader, right is Rust",
            stringify!($type)
        );
    };
}

#[test]
fn what_is_uploaded_fits_the_shaders() {
    assert_twins!(
        crate::stage::FRAME,
        View { clip_from_world, eye, perspective, forward, near, across, far, down, pixel, size, background, frame }
    );
}

/// One input, as the shader below reads it.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Asked {
    known: [f32; 3],
    h: f32,
    s: [f32; 3],
    width_px: f32,
}

/// Lobes of all questions, computed on the device.
fn answers(gpu: &Gpu, case: &Case, questions: &[Question]) -> Vec<[[f32; 3]; 4]> {
    let name = questions[0].fiber.name();
    let structure: String = name.split('_').map(|word| word[..1].to_uppercase() + &word[1..]).collect();
    let call = if case.wide {
        format!("{name}_eval_wide(models[i], known, q.h, q.width_px, s)")
    } else {
        format!("{name}_eval(models[i], known, q.h, s)")
    };
    let text = shader::source(&[name]).expect("the part exists")
        + &format!(
            "
struct Asked {{ known: vec3f, h: f32, s: vec3f, width_px: f32 }}
@group(0) @binding(0) var<storage, read> models: array<{structure}>;
@group(0) @binding(1) var<storage, read> asked: array<Asked>;
@group(0) @binding(2) var<storage, read_write> answers: array<vec4f>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {{
    let i = id.x;
    let q = asked[i];
    let known = Dir(q.known.x, q.known.y, q.known.z);
    let s = Dir(q.s.x, q.s.y, q.s.z);
    let lobes = {call};
    answers[4u * i] = vec4f(lobes.r, 0.0);
    answers[4u * i + 1u] = vec4f(lobes.tt, 0.0);
    answers[4u * i + 2u] = vec4f(lobes.trt, 0.0);
    answers[4u * i + 3u] = vec4f(lobes.residual, 0.0);
}}
"
        );
    let parameters: Vec<u8> = questions.iter().flat_map(|q| Parameters::from(q.fiber).bytes().to_vec()).collect();
    let asked: Vec<Asked> = questions
        .iter()
        .map(|q| Asked {
            known: [q.hit.known.sin_theta, q.hit.known.cos_theta, q.hit.known.phi],
            h: q.hit.h,
            s: [q.s.sin_theta, q.s.cos_theta, q.s.phi],
            width_px: q.hit.width_px,
        })
        .collect();
    let input = |contents: &[u8]| {
        gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: None,
            contents,
            usage: wgpu::BufferUsages::STORAGE,
        })
    };
    let (parameters, asked) = (input(&parameters), input(cast_slice(&asked)));
    let output = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: 64 * questions.len() as u64,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(name),
        source: wgpu::ShaderSource::Wgsl(text.into()),
    });
    let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(name),
        layout: None,
        module: &module,
        entry_point: Some("main"),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: parameters.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: asked.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 2, resource: output.as_entire_binding() },
        ],
    });
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(questions.len() as u32 / 64, 1, 1);
    }
    gpu.queue.submit([encoder.finish()]);
    let bytes = gpu.fetch(&output).unwrap_or_else(|error| panic!("{name}: {error}"));
    let values: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&bytes);
    values.chunks_exact(4).map(|lobes| std::array::from_fn(|p| [lobes[p][0], lobes[p][1], lobes[p][2]])).collect()
}

/// Compares a family on the device with double precision here.
///
/// A device rounds its sines, exponentials and powers as the standard lets it, not as Rust does: allowed are 1e-3 of the
/// brightest lobe, 1e-5 where nothing is, and sixteen times the model's own change by a rounding of its input (the
/// standard's arc tangent alone is 4096 units in the last place).
fn disagreements(gpu: &Gpu, case: &Case, stream: u32) -> (usize, Vec<String>) {
    let questions: Vec<Question> = (0..case.inputs).map(|index| Question::new(case, stream, index)).collect();
    let telling = questions.iter().filter(|question| question.brightest > 1e-3).count();
    let got = answers(gpu, case, &questions);
    let wrong = questions.iter().zip(&got).flat_map(|(question, got)| question.wrong(got, 1e-3, 1e-5, 16.0)).collect();
    (telling, wrong)
}

#[test]
fn models_have_the_same_values_on_the_device() {
    let gpu = gpu();
    for (i, case) in CASES.iter().chain(FAR_CASES).enumerate() {
        let (telling, wrong) = disagreements(&gpu, case, 500 + 10 * i as u32);
        assert!(wrong.is_empty(), "{} values differ, first {}", wrong.len(), wrong[0]);
        assert!(2 * telling >= case.inputs as usize, "only {telling} of {} values say anything", case.inputs);
    }
}
