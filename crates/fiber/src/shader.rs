//! The models as WGSL: text for renderers on the GPU, and the parameters in the layout it reads.
//!
//! Every file under `shaders/` is a part: pure functions without bindings and entry points, so that any
//! shader may be made of them. A part that is named like a model ([`Fiber::name`](crate::Fiber::name)) holds a
//! structure with its parameters and the twin of its evaluation, `<model>_eval(m, known, h, s) -> Lobes`:
//! `fcos` per lobe, as [`Scatter::eval`](crate::Scatter::eval) has it. The two that know near and far field
//! also have `<model>_eval_wide`, which takes the fiber's width in pixels before `s`.
//!
//! ```
//! use fiber::shader;
//!
//! let hair = fiber::Fiber::from(fiber::Chiang::<f32>::with_absorption(math::Rgb::splat(0.3)));
//! // A shader with what the model needs, once each, in an order that reads well.
//! let text = shader::source(&[hair.name()])?;
//! assert!(text.contains("fn chiang_eval(m: Chiang, known: Dir, h: f32, s: Dir) -> Lobes"));
//! // What to upload for it.
//! assert_eq!(shader::Parameters::from(hair).bytes().len(), 32);
//! # Ok::<(), shader::UnknownPart>(())
//! ```

mod parameters;

pub use parameters::{
    ArtistLobe, Caustic, Chiang, Deon, Fur, Glint, Hery, HeryLobe, Highlight, KajiyaKay, Lambertian, Marschner,
    Medulla, Parameters, Sadeghi,
};

macro_rules! parts {
    ($($name:literal in $file:literal needs [$($needed:literal),*];)*) => {
        /// Name and text of every part; each stands behind all that it needs.
        pub const PARTS: &[(&str, &str)] = &[$(($name, include_str!(concat!("../shaders/", $file))),)*];

        /// What each of [`PARTS`] needs itself, in their order.
        const NEEDS: &[&[&str]] = &[$(&[$($needed),*],)*];
    };
}

parts! {
    "fiber" in "fiber.wgsl" needs [];
    "quadrature" in "quadrature.wgsl" needs [];
    "bessel" in "lobe/bessel.wgsl" needs [];
    "longitudinal" in "lobe/longitudinal.wgsl" needs ["fiber", "bessel"];
    "attenuation" in "lobe/attenuation.wgsl" needs ["fiber"];
    "azimuthal" in "lobe/azimuthal.wgsl" needs ["fiber", "longitudinal"];
    "roots" in "lobe/roots.wgsl" needs ["fiber"];
    "caustic" in "lobe/caustic.wgsl" needs ["fiber", "roots"];
    "field" in "model/field.wgsl" needs ["fiber"];
    "lambertian" in "model/lambertian.wgsl" needs ["fiber"];
    "kajiya_kay" in "model/kajiya_kay.wgsl" needs ["fiber"];
    "hery" in "model/hery.wgsl" needs ["fiber", "longitudinal"];
    "deon" in "model/deon.wgsl" needs ["fiber", "quadrature", "longitudinal", "attenuation", "azimuthal", "field"];
    "chiang" in "model/chiang.wgsl" needs ["fiber", "quadrature", "longitudinal", "attenuation", "azimuthal", "field"];
    "sadeghi" in "model/sadeghi.wgsl" needs ["fiber", "quadrature", "longitudinal"];
    "marschner" in "model/marschner.wgsl"
        needs ["fiber", "longitudinal", "attenuation", "roots", "caustic", "lambertian"];
    "table" in "table.wgsl" needs ["fiber", "longitudinal", "lambertian", "deon", "chiang"];
    "spread" in "multiple/spread.wgsl" needs ["fiber", "longitudinal"];
    "fur" in "model/fur.wgsl" needs ["fiber", "longitudinal", "attenuation", "azimuthal"];
}

/// A part was asked for that does not exist.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no shader part is called {name:?}; there are {}", names())]
pub struct UnknownPart {
    /// The name that was asked for.
    pub name: String,
}

/// All names, for people.
fn names() -> String {
    PARTS.iter().map(|part| part.0).collect::<Vec<_>>().join(", ")
}

/// The text of one part, without what it needs.
pub fn part(name: &str) -> Option<&'static str> {
    PARTS.iter().find(|part| part.0 == name).map(|part| part.1)
}

/// The text of these parts and of all that they need, each once, whatever the order of the names.
///
/// # Errors
///
/// A name that no part has.
pub fn source(names: &[&str]) -> Result<String, UnknownPart> {
    let mut wanted = vec![false; PARTS.len()];
    for name in names {
        let Some(i) = PARTS.iter().position(|part| part.0 == *name) else {
            return Err(UnknownPart { name: (*name).to_owned() });
        };
        wanted[i] = true;
    }
    // Needs lie in front: one pass from the back finds all of them.
    for i in (0..PARTS.len()).rev() {
        for (j, part) in PARTS[..i].iter().enumerate() {
            wanted[j] |= wanted[i] && NEEDS[i].contains(&part.0);
        }
    }
    let mut text = String::new();
    for (part, _) in PARTS.iter().zip(wanted).filter(|(_, wanted)| *wanted) {
        if !text.is_empty() {
            text.push('\n');
        }
        text.push_str(part.1);
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_stand_behind_what_they_need() {
        assert_eq!(PARTS.len(), NEEDS.len());
        for (i, needs) in NEEDS.iter().enumerate() {
            for need in *needs {
                let found = PARTS[..i].iter().any(|part| part.0 == *need);
                assert!(found, "{} needs {need}, which is not in front of it", PARTS[i].0);
            }
        }
    }

    #[test]
    fn sources_hold_every_part_once() {
        let text = source(&["marschner", "bessel", "marschner"]).expect("both exist");
        for name in ["fiber", "bessel", "longitudinal", "attenuation", "roots", "caustic", "lambertian", "marschner"] {
            let part = part(name).expect("it exists");
            assert_eq!(text.matches(part).count(), 1, "{name}");
        }
        assert!(!text.contains("fn deon_eval"));
    }

    #[test]
    fn an_unknown_part_is_named_in_the_error() {
        let error = source(&["fiber", "chianti"]).expect_err("there is no such part");
        assert_eq!(error, UnknownPart { name: "chianti".to_owned() });
        let message = error.to_string();
        assert!(
            message.starts_with("no shader part is called \"chianti\"; there are fiber, quadrature, "),
            "{message}"
        );
        assert!(message.ends_with(", fur"), "{message}");
    }
}
