//! The shaders: that they are valid, that what is uploaded fits them, and that they compute what the models do.
//!
//! There may be no GPU, so values come from an interpreter of naga's representation, in single precision. It is
//! exact about the text; that a GPU rounds its sines and exponentials worse is for the crates that have one.

mod families;
mod interpreter;

use std::f32::consts::{FRAC_PI_2, PI};

use families::{CASES, Case, Draws, FAR_CASES, Question};
use fiber::shader::{self, PARTS, Parameters};
use fiber::{Dir, Fiber, Hit};
use interpreter::{Machine, Value};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{Module, TypeInner};

// --- Text

/// A validated module, or what is wrong with it.
fn compile(text: &str) -> Result<Module, String> {
    let module = naga::front::wgsl::parse_str(text).map_err(|error| error.emit_to_string(text))?;
    // Nothing beyond what every WebGPU device has.
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
    validator.validate(&module).map_err(|error| error.emit_to_string(text))?;
    Ok(module)
}

fn all_parts() -> Module {
    let names: Vec<&str> = PARTS.iter().map(|part| part.0).collect();
    let text = shader::source(&names).expect("all parts exist");
    compile(&text).unwrap_or_else(|error| panic!("all parts together: {error}"))
}

#[test]
fn every_part_is_valid_with_what_it_needs_and_all_together() {
    let mut wrong = Vec::new();
    for (name, _) in PARTS {
        let text = shader::source(&[*name]).expect("the part exists");
        match compile(&text) {
            Err(error) => wrong.push(format!("{name}: {error}")),
            Ok(module) if !module.global_variables.is_empty() => wrong.push(format!("{name} has bindings")),
            Ok(module) if !module.entry_points.is_empty() => wrong.push(format!("{name} has entry points")),
            Ok(_) => {}
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(all_parts().functions.len() > 50);
}

#[test]
fn no_file_of_the_folder_is_forgotten() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
    let mut files = Vec::new();
    for folder in [folder.clone(), folder.join("lobe"), folder.join("model"), folder.join("multiple")] {
        for entry in std::fs::read_dir(&folder).expect("the folder can be read") {
            let path = entry.expect("its entries too").path();
            if path.extension().is_some_and(|extension| extension == "wgsl") {
                files.push(std::fs::read_to_string(&path).expect("a text"));
            }
        }
    }
    assert_eq!(files.len(), PARTS.len());
    for (name, text) in PARTS {
        assert!(files.iter().any(|file| file == text), "{name}");
    }
}

// --- Functions

/// Names of the arguments and of their types, and of the type returned; unnamed types are empty.
fn signature(module: &Module, function: &str) -> Option<(Vec<(String, String)>, String)> {
    let found = module.functions.iter().find(|(_, f)| f.name.as_deref() == Some(function))?.1;
    let type_name = |ty: naga::Handle<naga::Type>| module.types[ty].name.clone().unwrap_or_default();
    let arguments =
        found.arguments.iter().map(|argument| (argument.name.clone().unwrap_or_default(), type_name(argument.ty)));
    Some((arguments.collect(), found.result.as_ref().map(|result| type_name(result.ty)).unwrap_or_default()))
}

/// One of every model.
fn one_of_each() -> Vec<Fiber> {
    CASES.iter().map(|case| (case.single)(&mut Draws::new(7, 0))).collect()
}

#[test]
fn every_model_has_its_evaluation() {
    let module = all_parts();
    for fiber in one_of_each() {
        let name = fiber.name();
        assert!(shader::part(name).is_some(), "there is no part {name}");
        let (arguments, result) =
            signature(&module, &format!("{name}_eval")).unwrap_or_else(|| panic!("there is no {name}_eval"));
        let names: Vec<&str> = arguments.iter().map(|argument| argument.0.as_str()).collect();
        assert_eq!(names, ["m", "known", "h", "s"], "{name}");
        let structure: String = name.split('_').map(capitalised).collect();
        let types: Vec<&str> = arguments.iter().map(|argument| argument.1.as_str()).collect();
        assert_eq!(types, [structure.as_str(), "Dir", "", "Dir"], "{name}");
        assert_eq!(result, "Lobes", "{name}");
    }
}

fn capitalised(word: &str) -> String {
    let (first, rest) = word.split_at(1);
    first.to_uppercase() + rest
}

/// Names of the arguments of the first `fn name` behind `anchor`, without a receiver; and whether it has one.
fn arguments_in_rust(text: &str, anchor: &str, name: &str) -> (Vec<String>, bool) {
    let behind = text.find(anchor).unwrap_or_else(|| panic!("{anchor:?} is gone"));
    let text = &text[behind..];
    let starts = [format!("fn {name}("), format!("fn {name}<")].map(|start| text.find(&start));
    let start = starts.into_iter().flatten().min().unwrap_or_else(|| panic!("fn {name} is gone"));
    let open = start + text[start..].find('(').expect("arguments have a parenthesis");
    let (mut names, mut depth, mut word) = (Vec::new(), 0, String::new());
    for letter in text[open + 1..].chars() {
        match letter {
            ')' if depth == 0 => break,
            '(' | '[' | '<' => depth += 1,
            ')' | ']' | '>' => depth -= 1,
            _ => {}
        }
        if letter == ',' && depth == 0 {
            names.push(std::mem::take(&mut word));
        } else {
            word.push(letter);
        }
    }
    names.push(word);
    let names = names.iter().map(|name| name.split(':').next().unwrap_or("").trim().trim_start_matches("mut "));
    let names: Vec<&str> = names.filter(|name| !name.is_empty()).collect();
    let method = names.first().is_some_and(|name| name.ends_with("self"));
    (names[usize::from(method)..].iter().map(|name| (*name).to_owned()).collect(), method)
}

#[test]
fn twin_functions_take_their_arguments_in_the_same_order() {
    const DIR: &str = include_str!("../src/dir.rs");
    const BESSEL: &str = include_str!("../src/lobe/bessel.rs");
    const LONGITUDINAL: &str = include_str!("../src/lobe/longitudinal.rs");
    const ATTENUATION: &str = include_str!("../src/lobe/attenuation.rs");
    const AZIMUTHAL: &str = include_str!("../src/lobe/azimuthal.rs");
    const FIELD: &str = include_str!("../src/model/field.rs");
    const MARSCHNER: &str = include_str!("../src/model/marschner.rs");
    let twins = [
        ("wrap_angle", DIR, "", "wrap_angle"),
        ("cos2_half_difference", DIR, "", "cos2_half_difference"),
        ("bessel_i0e", BESSEL, "", "i0e"),
        ("cone_specular", LONGITUDINAL, "impl<F: Real> Cone<F>", "specular"),
        ("longitudinal_density", LONGITUDINAL, "pub fn density<F: Real>", "density"),
        ("truncated_new", LONGITUDINAL, "impl<F: Real> Truncated<F>", "new"),
        ("truncated_density", LONGITUDINAL, "impl<F: Real> Truncated<F>", "density"),
        ("fresnel", ATTENUATION, "", "fresnel"),
        ("optics_new", ATTENUATION, "impl<F: Real> Optics<F>", "new"),
        ("optics_path", ATTENUATION, "impl<F: Real> Optics<F>", "path"),
        ("optics_path_at", ATTENUATION, "impl<F: Real> Optics<F>", "path_at"),
        ("path_exit_azimuth", ATTENUATION, "impl<F: Real> Path<F>", "exit_azimuth"),
        ("path_attenuation", ATTENUATION, "impl<F: Real> Path<F>", "attenuation"),
        ("wrapped_gaussian", AZIMUTHAL, "", "wrapped_gaussian"),
        ("trimmed_logistic", AZIMUTHAL, "", "trimmed_logistic"),
        ("field_near_share", FIELD, "", "near_share"),
        ("marschner_azimuthal", MARSCHNER, "", "azimuthal"),
    ];
    let module = all_parts();
    for (shader, text, anchor, name) in twins {
        let (arguments, _) = signature(&module, shader).unwrap_or_else(|| panic!("there is no {shader}"));
        let in_shader: Vec<String> = arguments.into_iter().map(|argument| argument.0).collect();
        let (in_rust, method) = arguments_in_rust(text, anchor, name);
        // What a method is called on comes first in the shader.
        assert_eq!(in_shader[usize::from(method)..], in_rust[..], "{shader}");
    }
}

// --- Layout

/// Size and members with their offsets of a structure, in bytes.
fn layout(module: &Module, name: &str) -> (usize, Vec<(String, usize)>) {
    let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name));
    let (_, ty) = found.unwrap_or_else(|| panic!("the shaders have no structure {name}"));
    let TypeInner::Struct { members, span } = &ty.inner else { panic!("{name} is no structure") };
    let members = members.iter().map(|member| (member.name.clone().unwrap_or_default(), member.offset as usize));
    (*span as usize, members.collect())
}

macro_rules! assert_twins {
    ($module:expr, $name:ident { $($member:ident),* $(,)? }) => {
        let here = vec![$((stringify!($member).to_owned(), std::mem::offset_of!(shader::$name, $member)),)*];
        assert_eq!(
            layout($module, stringify!($name)),
            (size_of::<shader::$name>(), here),
            "{}: left is the shader, right is Rust",
            stringify!($name)
        );
    };
}

#[test]
fn what_is_uploaded_fits_the_shaders() {
    let module = &all_parts();
    assert_twins!(module, Deon { sigma_a, eta, beta_m, beta_n, alpha, residual, attenuation, field });
    assert_twins!(module, Chiang { sigma_a, eta, beta_m, beta_n, alpha, field });
    assert_twins!(module, Lambertian { albedo });
    assert_twins!(module, Highlight { color, exponent, shift });
    assert_twins!(module, KajiyaKay { diffuse, mode, highlights });
    assert_twins!(module, HeryLobe { tint, beta, alpha });
    assert_twins!(module, Hery { lobes, mode, cos_theta_d });
    assert_twins!(module, ArtistLobe { color, intensity, shift, width });
    assert_twins!(module, Glint { intensity, width, angle });
    assert_twins!(module, Sadeghi { lobes, tt_azimuthal_width, glint, mode });
    assert_twins!(module, Caustic { strength, width, fade, limit });
    assert_twins!(
        module,
        Marschner { sigma_a, eta, diffuse, beta_m, alpha, eccentricity, roots, norm, caustic, has_caustic }
    );
    assert_twins!(module, Medulla { absorption, radius, scattering, tabulated_radius });
    assert_twins!(module, Fur { sigma_a, eta, beta_m, beta_n, alpha, layers, medulla, cells });
}

// --- Values

fn dir_value(d: Dir) -> Value {
    Value::many([d.sin_theta, d.cos_theta, d.phi].map(Value::F32).to_vec())
}

/// What the shader says: lobes, then channels.
fn shaded(machine: &Machine<'_>, fiber: Fiber, hit: &Hit, s: Dir, wide: bool) -> [[f32; 3]; 4] {
    let mut function = format!("{}_eval", fiber.name());
    let mut arguments = vec![dir_value(hit.known), Value::F32(hit.h)];
    if wide {
        function.push_str("_wide");
        arguments.push(Value::F32(hit.width_px));
    }
    arguments.push(dir_value(s));
    // By way of the bytes that would be uploaded.
    arguments.insert(0, machine.argument_from_bytes(&function, 0, Parameters::from(fiber).bytes()));
    let lobes = machine.call(&function, &arguments);
    std::array::from_fn(|p| std::array::from_fn(|channel| lobes.parts()[p].parts()[channel].f32()))
}

/// Compares shader and model on seeded inputs. Returns how many values were not next to nothing, and what was wrong.
///
/// Allowed are 1e-4 of the brightest lobe of the same value, 1e-6 where nothing is, and the model's own change.
fn disagreements(machine: &Machine<'_>, case: &Case, stream: u32) -> (u32, Vec<String>) {
    let (mut telling, mut wrong) = (0, Vec::new());
    for index in 0..case.inputs {
        let question = Question::new(case, stream, index);
        telling += u32::from(question.brightest > 1e-3);
        let got = shaded(machine, question.fiber, &question.hit, question.s, case.wide);
        wrong.extend(question.wrong(&got, 1e-4, 1e-6, 1.0));
    }
    (telling, wrong)
}

#[track_caller]
fn assert_agreement(cases: &[Case]) {
    let module = all_parts();
    let machine = Machine::new(&module);
    for (i, case) in cases.iter().enumerate() {
        let (telling, wrong) = disagreements(&machine, case, 500 + 10 * i as u32);
        assert!(wrong.is_empty(), "{} values differ, first {}", wrong.len(), wrong[0]);
        // Half of the directions were drawn where light goes.
        assert!(2 * telling >= case.inputs, "only {telling} of {} values say anything", case.inputs);
    }
}

#[test]
fn shaders_compute_what_the_models_do() {
    assert_agreement(CASES);
}

#[test]
fn shaders_compute_the_far_field_of_the_models() {
    assert_agreement(FAR_CASES);
}

/// The comparison has teeth: small errors in a shader are seen.
#[test]
fn wrong_shaders_are_noticed() {
    let names: Vec<&str> = PARTS.iter().map(|part| part.0).collect();
    let sound = shader::source(&names).expect("all parts exist");
    let errors = [
        ("vec4f(2.0, -1.0, -4.0, 0.0)", "vec4f(2.0, -1.0, -3.0, 0.0)", 0),
        ("0.812 * b2", "0.813 * b2", 1),
        ("(PI - x) * cos(x)", "PI * cos(x)", 2),
        ("(exponent + 2.0) / (exponent + 1.0)", "1.0", 3),
        ("0.5 * gaussian(beta, x)", "gaussian(beta, x)", 4),
        ("0.5 * cos_gamma / slope", "0.501 * cos_gamma / slope", 5),
        ("4.0 + 2.0 * glint_height", "4.0 + glint_height", 6),
        ("(1.0 - first_share)", "1.0", 7),
    ];
    for (right, wrong, case) in errors {
        assert!(sound.contains(right), "{right} is gone");
        let module = compile(&sound.replace(right, wrong)).expect("still valid");
        let case = Case { inputs: 256, ..CASES[case] };
        let (_, found) = disagreements(&Machine::new(&module), &case, 900);
        assert!(!found.is_empty(), "nothing was said about {wrong} for {right}");
    }
}

#[test]
fn shaders_stay_finite_at_the_edges() {
    let module = all_parts();
    let machine = Machine::new(&module);
    let angles = [-FRAC_PI_2, -FRAC_PI_2 + 1e-6, 0.0, 0.3, FRAC_PI_2 - 1e-6, FRAC_PI_2];
    let mut checked = 0;
    for case in CASES {
        for index in 0..6 {
            let fiber = (case.single)(&mut Draws::new(77, index));
            for theta_k in angles {
                for (theta_s, phi) in angles.into_iter().zip([0.0, PI, -PI, 2.0 * PI, 1e4, 1.0]) {
                    for h in [-1.0, 0.0, 1.0 - 1e-7, 1.0] {
                        let hit = Hit::new(Dir::new(theta_k, 0.0), h);
                        let got = shaded(&machine, fiber, &hit, Dir::new(theta_s, phi), false);
                        let sound = got.iter().flatten().all(|x| x.is_finite() && *x >= 0.0);
                        assert!(sound, "{got:?} for {fiber:?} {hit:?} to {theta_s}, {phi}");
                        checked += 1;
                    }
                }
            }
        }
    }
    assert_eq!(checked, CASES.len() * 6 * 6 * 6 * 4);
}
