//! Grown hair: from its section of the file to a groom.

use groom::{Groom, GrowError, Head, Mesh, Recipe, Scalp};
use math::Vec3;

use crate::error::{SceneError, SceneErrorKind};
use crate::file::{EllipsoidSection, GroomPresetKind, ProceduralSection, RegionKind};
use crate::source::Source;

/// Cells along the longest side of an ellipsoid's distance grid.
const GRID: usize = 64;

/// Grows the hair of the groom at `path`.
pub(crate) fn grow(path: &str, section: &ProceduralSection, source: &Source<'_>) -> Result<Groom, SceneError> {
    let path = format!("{path}.procedural");
    let recipe = recipe(section);
    let head = match &section.ellipsoid {
        None => {
            let everywhere = section.preset == GroomPresetKind::Fur;
            let default = if everywhere { RegionKind::Everywhere } else { RegionKind::Scalp };
            let mut head = groom::mannequin();
            if section.region.unwrap_or(default) == RegionKind::Everywhere {
                head.scalp = Scalp::Everywhere;
            }
            head
        }
        Some(_) if section.region == Some(RegionKind::Scalp) => {
            let path = format!("{path}.region");
            let message = format!("`{path}`: an ellipsoid has no hairline; see its key `above`");
            return Err(source.at_value(SceneErrorKind::Conflict, &path, message));
        }
        Some(ellipsoid) => body(&format!("{path}.ellipsoid"), ellipsoid, source)?,
    };
    groom::grow(&recipe, &head).map_err(|error| {
        let (path, kind) = match &error {
            GrowError::Value { name, .. } => (format!("{path}.{}", key_of(name)), SceneErrorKind::OutOfRange),
            GrowError::TooManyPoints { .. } => (format!("{path}.strands"), SceneErrorKind::OutOfRange),
            _ => (path.clone(), SceneErrorKind::Conflict),
        };
        source.at_value(kind, &path, format!("`{path}`: {error}"))
    })
}

/// The ellipsoid as something to grow hair on.
fn body(path: &str, section: &EllipsoidSection, source: &Source<'_>) -> Result<Head, SceneError> {
    let refuse = |key: &str, x: f64, least: f64| {
        let path = format!("{path}.{key}");
        let message = format!("`{path}` is {x}; it must be between {least} and 1000000");
        source.at_value(SceneErrorKind::OutOfRange, &path, message)
    };
    for x in section.center {
        if !(-1e6..=1e6).contains(&x) {
            return Err(refuse("center", x, -1e6));
        }
    }
    for x in section.radii {
        if !(1e-3..=1e6).contains(&x) {
            return Err(refuse("radii", x, 1e-3));
        }
    }
    let above = section.above.unwrap_or(-1e6);
    if !(-1e6..=1e6).contains(&above) {
        return Err(refuse("above", above, -1e6));
    }
    let [center, radii] = [section.center, section.radii].map(|v| Vec3::from_array(v.map(|x| x as f32)));
    let mut head = Head::from_mesh(Mesh::ellipsoid(center, radii, 4), GRID).map_err(|error| {
        let message = format!("`{path}`: {error}");
        source.at_value(SceneErrorKind::OutOfRange, path, message)
    })?;
    if section.above.is_some() {
        head.scalp = Scalp::Above(above as f32);
    }
    Ok(head)
}

/// The key of the file for a field of the recipe.
fn key_of(field: &str) -> &str {
    match field {
        "strand_count" => "strands",
        "points_per_strand" => "points",
        "guide_count" => "guides",
        "clump_count" => "clumps",
        "the length of comb" => "comb",
        same => same,
    }
}

/// The preset with everything that the file changes.
fn recipe(section: &ProceduralSection) -> Recipe {
    let mut recipe = match section.preset {
        GroomPresetKind::WavyLong => Recipe::wavy_long(),
        GroomPresetKind::Straight => Recipe::straight(),
        GroomPresetKind::Short => Recipe::short(),
        GroomPresetKind::Curly => Recipe::curly(),
        GroomPresetKind::Fur => Recipe::fur(),
    };
    recipe.seed = section.seed.unwrap_or(recipe.seed);
    recipe.strand_count = section.strands.unwrap_or(recipe.strand_count);
    recipe.points_per_strand = section.points.unwrap_or(recipe.points_per_strand);
    recipe.guide_count = section.guides.unwrap_or(recipe.guide_count);
    recipe.clump_count = section.clumps.unwrap_or(recipe.clump_count);
    if let Some(comb) = section.comb {
        recipe.comb = Vec3::from_array(comb.map(|x| x as f32));
    }
    macro_rules! changed {
        ($($field:ident),* $(,)?) => {
            $(if let Some(x) = section.$field {
                recipe.$field = x as f32;
            })*
        };
    }
    changed!(
        hairline_front,
        hairline_nape,
        hairline_softness,
        parting,
        parting_strength,
        length,
        length_variation,
        layering,
        gravity,
        lift,
        volume,
        comb_length,
        wander,
        over_shoulders,
        clump_strength,
        clump_profile,
        wave_amplitude,
        wave_length,
        wave_start,
        curl_radius,
        curl_turns,
        frizz,
        frizz_length,
        flyaways,
        randomness,
    );
    recipe
}

#[cfg(test)]
mod tests {
    use crate::{NoAssets, Scene, SceneErrorKind};

    #[test]
    fn wrong_values_of_a_recipe_are_placed() {
        // The line after `[groom.procedural]`, the column of its value.
        for (line, column) in [("strands = 0", 11), ("points = 1", 10), ("lift = nan", 8), ("comb = [0, 0, 0]", 8)] {
            let text = format!("[[groom]]\n[groom.procedural]\n{line}\n");
            let error = Scene::load(&text, &[], &NoAssets).unwrap_err();
            assert_eq!(error.kind, SceneErrorKind::OutOfRange, "{error}");
            let place = error.place.clone().unwrap();
            assert_eq!((place.line, place.column), (3, column), "{error}");
        }
    }

    #[test]
    fn hair_grows_on_an_ellipsoid_in_scene_units() {
        let text = "[[groom]]\nprocedural = { preset = \"short\", strands = 50, length = 1.0, \
                    ellipsoid = { center = [100.0, 0.0, 0.0], radii = [3.0, 4.0, 3.0], above = 1.0 } }\n";
        let scene = Scene::load(text, &[], &NoAssets).unwrap_or_else(|error| panic!("{error}"));
        let (least, most) = scene.bounds().unwrap();
        // Roots above y = 1 on a surface around x = 100, strands about a unit long.
        assert!(least.x > 94.0 && most.x < 106.0 && most.y < 7.0 && least.y > -2.0);
    }
}
