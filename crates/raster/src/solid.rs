//! What is not hair: meshes, and area lights that the camera sees.
//!
//! # Resources
//!
//! A vertex and an index buffer for each mesh: position, normal and colour, 36 bytes a vertex. Smooth meshes share
//! vertices; those without normals are flat, and each triangle has its own three.
//!
//! # Differences from the path tracer
//!
//! - A sphere light is a polyhedron of 5120 faces inside the sphere.
//! - Lights lie behind all hair: what one adds to hair behind it is missing.
//! - Ambient light reaches all of a mesh: neither hair nor meshes keep it off.

use bytemuck::{Pod, Zeroable, cast_slice};
use groom::Mesh;
use math::{Rgb, Vec3};
use scene::{Light, Scene};

use crate::RasterError;
use crate::frame::{Frame, depth, kept};
use crate::gpu::Gpu;
use crate::meter::Allocation;
use crate::stage::{COLOR, Context, DEPTH, MeshPass, Stage, depth_test, target, texture_2d};

const OWNER: &str = "scene";

/// The shaders: vertices and lights; meshes.
pub(crate) const TEXT: &str = include_str!("../shaders/solid.wgsl");
pub(crate) const LIT: &str = include_str!("../shaders/solid_lit.wgsl");

/// How finely a sphere light is drawn: 20 triangles, quartered so often.
const SPHERE_SUBDIVISIONS: u32 = 4;

/// A corner; as `solid_vertex` takes it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct Vertex {
    position: [f32; 3],
    normal: [f32; 3],
    /// Albedo of a mesh, radiance of a light.
    color: [f32; 3],
}

static ATTRIBUTES: [wgpu::VertexAttribute; 3] =
    wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x3];

fn layout() -> wgpu::VertexBufferLayout<'static> {
    wgpu::VertexBufferLayout {
        array_stride: size_of::<Vertex>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &ATTRIBUTES,
    }
}

/// Light that is added to what lies behind it, and covers nothing.
const GLOW: wgpu::BlendState = wgpu::BlendState {
    color: wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    },
    alpha: wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::Zero,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    },
};

/// Triangles.
#[derive(Clone, Debug, Default)]
struct Triangles {
    vertices: Vec<Vertex>,
    indices: Vec<u32>,
}

impl Triangles {
    /// A mesh: with its own normals, or flat.
    fn of(mesh: &Mesh, color: Rgb) -> Self {
        let vertex = |p: Vec3, n: Vec3| Vertex { position: p.to_array(), normal: n.to_array(), color: color.0 };
        if let Some(normals) = &mesh.normals {
            let vertices = mesh.positions.iter().zip(normals).map(|(&p, &n)| vertex(p, n)).collect();
            return Self { vertices, indices: mesh.triangles.iter().flatten().copied().collect() };
        }
        let mut vertices = Vec::with_capacity(3 * mesh.triangles.len());
        for triangle in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(triangle);
            // A triangle without area is not seen; its normal only has to be a number.
            let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
            vertices.extend([a, b, c].map(|p| vertex(p, normal)));
        }
        let indices = (0..vertices.len() as u32).collect();
        Self { vertices, indices }
    }

    /// The shining sides of an area light that the camera sees; counter-clockwise seen from where they shine to.
    fn of_light(light: &Light) -> Option<Self> {
        match light {
            Light::Rectangle { center, edge_u, edge_v, normal, radiance, two_sided, visible: true } => {
                let (u, v) = (0.5 * *edge_u, 0.5 * *edge_v);
                let corners = [*center - u - v, *center + u - v, *center + u + v, *center - u + v];
                let corners =
                    corners.map(|p| Vertex { position: p.to_array(), normal: normal.to_array(), color: radiance.0 });
                let mut indices = vec![0, 1, 2, 0, 2, 3];
                if *two_sided {
                    indices.extend([0, 2, 1, 0, 3, 2]);
                }
                Some(Self { vertices: corners.to_vec(), indices })
            }
            Light::Sphere { center, radius, radiance, visible: true } => {
                Some(Self::of(&Mesh::sphere(*center, *radius, SPHERE_SUBDIVISIONS), *radiance))
            }
            Light::Rectangle { .. }
            | Light::Sphere { .. }
            | Light::Environment { .. }
            | Light::Point { .. }
            | Light::Spot { .. }
            | Light::Distant { .. } => None,
        }
    }
}

/// Triangles on the device.
#[derive(Debug)]
struct Uploaded {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    count: u32,
}

impl Uploaded {
    fn new(gpu: &Gpu, triangles: &Triangles) -> Result<Self, RasterError> {
        let most = gpu.largest_binding();
        let found = size_of_val(triangles.vertices.as_slice()).max(size_of_val(triangles.indices.as_slice())) as u64;
        if found > most {
            return Err(RasterError::TooLarge { what: "bytes of one mesh", found, most });
        }
        let buffer = |label, contents, usage| gpu.buffer(label, contents, usage);
        Ok(Self {
            vertices: buffer("mesh", cast_slice(&triangles.vertices), wgpu::BufferUsages::VERTEX),
            indices: buffer("mesh indices", cast_slice(&triangles.indices), wgpu::BufferUsages::INDEX),
            count: triangles.indices.len() as u32,
        })
    }

    fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..self.count, 0, 0..1);
    }

    fn bytes(&self) -> u64 {
        self.vertices.size() + self.indices.size()
    }
}

/// Everything solid of a scene, on the device.
#[derive(Debug)]
pub(crate) struct Solids {
    /// Meshes, and whether the camera sees them.
    meshes: Vec<(Uploaded, bool)>,
    /// Lights that the camera sees.
    lights: Vec<Uploaded>,
    /// Stands in group 0 for the depth of what is solid while that is drawn.
    nothing: wgpu::TextureView,
}

impl Solids {
    /// Uploads meshes and visible lights.
    pub(crate) fn new(gpu: &Gpu, scene: &Scene) -> Result<Self, RasterError> {
        let mut meshes = Vec::new();
        for mesh in scene.meshes.iter().filter(|mesh| !mesh.mesh.triangles.is_empty()) {
            meshes.push((Uploaded::new(gpu, &Triangles::of(&mesh.mesh, mesh.albedo))?, mesh.visible));
        }
        let lights = scene.lights.iter().filter_map(Triangles::of_light);
        let lights = lights.map(|light| Uploaded::new(gpu, &light)).collect::<Result<_, _>>()?;
        let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::RENDER_ATTACHMENT;
        let nothing = gpu.device.create_texture(&texture_2d("no depth", [1, 1], 1, DEPTH, usage));
        let nothing = nothing.create_view(&wgpu::TextureViewDescriptor::default());
        Ok(Self { meshes, lights, nothing })
    }

    /// A pipeline for [`draw_depth`](Self::draw_depth): group 0 and a depth attachment, no colour.
    pub(crate) fn depth_pipeline(&self, gpu: &Gpu, stage: &Stage, label: &'static str) -> wgpu::RenderPipeline {
        stage.mesh(
            gpu,
            &MeshPass {
                label,
                part: TEXT,
                vertex: "solid_vertex",
                fragment: None,
                shades: false,
                buffers: &[Some(layout())],
                targets: &[],
                depth: Some(depth_test(true)),
            },
        )
    }

    /// Draws all meshes, also those that the camera does not see: they cast shadows. Pipeline and group 0 are set.
    pub(crate) fn draw_depth(&self, pass: &mut wgpu::RenderPass<'_>) {
        for (mesh, _) in &self.meshes {
            mesh.draw(pass);
        }
    }

    /// Draws what the camera sees over the sky, and the depth of it.
    pub(crate) fn record(&self, context: &Context<'_>, frame: &mut Frame) {
        let (gpu, stage, targets) = (context.gpu, context.stage, context.targets);
        let view = stage.view(gpu, context.view, &self.nothing);
        // Also without meshes: everybody else reads the depth.
        let cleared_depth = Some(depth(&targets.solid_view, true));
        let mut pass = frame.render(OWNER, "solid", &[kept(&targets.color_view)], cleared_depth);
        if self.meshes.iter().any(|(_, visible)| *visible) {
            let pipeline = stage.mesh(
                gpu,
                &MeshPass {
                    label: "solid meshes",
                    part: &[TEXT, LIT].join("\n"),
                    vertex: "solid_vertex",
                    fragment: Some("solid_fragment"),
                    shades: true,
                    buffers: &[Some(layout())],
                    targets: &[target(COLOR, None)],
                    depth: Some(depth_test(true)),
                },
            );
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &view, &[]);
            pass.set_bind_group(2, context.shading_group, &[]);
            for (mesh, _) in self.meshes.iter().filter(|(_, visible)| *visible) {
                mesh.draw(&mut pass);
            }
        }
        if !self.lights.is_empty() {
            let pipeline = stage.mesh(
                gpu,
                &MeshPass {
                    label: "visible lights",
                    part: TEXT,
                    vertex: "solid_vertex",
                    fragment: Some("solid_glow"),
                    shades: false,
                    buffers: &[Some(layout())],
                    targets: &[target(COLOR, Some(GLOW))],
                    depth: Some(depth_test(false)),
                },
            );
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &view, &[]);
            for light in &self.lights {
                light.draw(&mut pass);
            }
        }
    }

    /// What is kept on the device.
    pub(crate) fn memory(&self) -> Vec<Allocation> {
        let meshes = self.meshes.iter().map(|(mesh, _)| mesh);
        let bytes = meshes.chain(&self.lights).map(Uploaded::bytes).sum();
        vec![Allocation { owner: OWNER, name: "meshes".to_owned(), bytes }]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sum of the cross products of the triangles' edges, halved: vector area. And sum of their sizes.
    fn areas(triangles: &Triangles) -> (Vec3, f32) {
        let at = |i: u32| Vec3::from(triangles.vertices[i as usize].position);
        let halves = triangles.indices.chunks_exact(3).map(|t| {
            let (a, b, c) = (at(t[0]), at(t[1]), at(t[2]));
            0.5 * (b - a).cross(c - a)
        });
        halves.fold((Vec3::ZERO, 0.0), |(sum, size), half| (sum + half, size + half.length()))
    }

    #[test]
    fn flat_meshes_have_the_normal_of_each_face() {
        let mut mesh = Mesh::ellipsoid(Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, 2.0, 0.5), 2);
        let smooth = Triangles::of(&mesh, Rgb::white());
        assert_eq!(smooth.vertices.len(), mesh.positions.len());
        mesh.normals = None;
        let flat = Triangles::of(&mesh, Rgb::new(0.1, 0.2, 0.3));
        assert_eq!(flat.vertices.len(), 3 * mesh.triangles.len());
        assert_eq!(areas(&flat), areas(&smooth));
        for corner in flat.vertices.chunks_exact(3) {
            let [a, b, c] = std::array::from_fn(|i| Vec3::from(corner[i].position));
            let normal = Vec3::from(corner[0].normal);
            assert!(normal.dot(b - a).abs() < 1e-5 && normal.dot(c - a).abs() < 1e-5);
            // Outwards.
            assert!(normal.dot(a - Vec3::new(1.0, 2.0, 3.0)) > 0.0);
            assert_eq!((corner[0].normal, corner[0].color), (corner[2].normal, [0.1, 0.2, 0.3]));
        }
    }

    #[test]
    fn lights_face_where_they_shine() {
        let rectangle = |two_sided, visible| Light::Rectangle {
            center: Vec3::new(1.0, 5.0, 0.0),
            edge_u: Vec3::new(2.0, 0.0, 0.0),
            edge_v: Vec3::new(0.0, 0.0, 3.0),
            normal: Vec3::NEG_Y,
            radiance: Rgb::new(1.0, 2.0, 3.0),
            two_sided,
            visible,
        };
        let one = Triangles::of_light(&rectangle(false, true)).unwrap();
        let (sum, size) = areas(&one);
        // edge_u × edge_v points to the normal, and so does the vector area; it is the light's area long.
        assert!((sum - Vec3::new(0.0, -6.0, 0.0)).length() < 1e-5 && (size - 6.0).abs() < 1e-5, "{sum} {size}");
        assert_eq!(one.vertices[0].color, [1.0, 2.0, 3.0]);
        let (sum, size) = areas(&Triangles::of_light(&rectangle(true, true)).unwrap());
        assert!(sum.length() < 1e-5 && (size - 12.0).abs() < 1e-5, "{sum} {size}");
        assert!(Triangles::of_light(&rectangle(true, false)).is_none());

        let center = Vec3::new(0.0, 1.0, 2.0);
        let sphere = Light::Sphere { center, radius: 0.5, radiance: Rgb::white(), visible: true };
        let (sum, size) = areas(&Triangles::of_light(&sphere).unwrap());
        // 5120 faces have edges of 0.07 radii: less than a percent of the area is missing.
        let share = size / (4.0 * std::f32::consts::PI * 0.25);
        assert!(sum.length() < 1e-4 && share > 0.99 && share < 1.0, "{sum} {share}");
        let point = Light::Point { position: center, intensity: Rgb::white() };
        assert!(Triangles::of_light(&point).is_none());
    }

    #[test]
    fn the_shaders_are_valid() {
        // What the shading text promises to have.
        let promised = "struct LampLight { direction: vec3f, irradiance: vec3f }\n\
            fn lamp_count() -> u32 { return 1u; }\n\
            fn lamp_ambient_irradiance(n: vec3f) -> vec3f { return n; }\n\
            fn lamp_arriving(i: u32, p: vec3f) -> LampLight { return LampLight(normalize(p), vec3f(f32(i))); }\n\
            fn shadow_solid(i: u32, p: vec3f) -> f32 { return p.x; }\n\
            fn shadow_lit(i: u32, p: vec3f) -> f32 { return p.y; }\n";
        for (shading, part) in [("", TEXT.to_owned()), (promised, [TEXT, LIT].join("\n"))] {
            let text = [crate::stage::FRAME, crate::stage::FRAGMENT, shading, &part].join("\n");
            let module = naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
            let flags = naga::valid::ValidationFlags::all();
            let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty());
            validator.validate(&module).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
        }
    }
}
