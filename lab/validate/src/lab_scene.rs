//! The lab's `scene.json`, and the same scene in our words.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, bail};
use job::{Cancel, LoadedScene, Options, Outcome, Source};
use serde::Deserialize;

/// The file that `gen_groom.py` writes. Lengths are in `units`.
#[derive(Debug, Deserialize)]
pub(crate) struct LabScene {
    units: String,
    up: String,
    groom: String,
    pub(crate) camera: Camera,
    pub(crate) head: Head,
    lights: BTreeMap<String, Light>,
    materials: BTreeMap<String, Material>,
}

/// A pinhole.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Camera {
    pub(crate) origin: [f64; 3],
    pub(crate) target: [f64; 3],
    pub(crate) up: [f64; 3],
    /// Vertical, degrees.
    pub(crate) fov_y_deg: f64,
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) pixel_filter: String,
}

/// A diffuse sphere.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Head {
    pub(crate) center: [f64; 3],
    pub(crate) radius: f64,
    pub(crate) albedo: [f64; 3],
}

#[derive(Debug, Deserialize)]
struct Light {
    /// Radiance from everywhere.
    env: [f64; 3],
    rects: Vec<Rectangle>,
}

#[derive(Debug, Deserialize)]
struct Rectangle {
    center: [f64; 3],
    #[serde(default)]
    aim: [f64; 3],
    width: f64,
    height: f64,
    radiance: [f64; 3],
    one_sided: bool,
}

/// Hair of Chiang's model.
#[derive(Debug, Deserialize)]
pub(crate) struct Material {
    beta_m: f64,
    beta_n: f64,
    /// In the sign of d'Eon, pbrt and Mitsuba, strands root to tip: ours too.
    alpha_deg: f64,
    ior: f64,
    /// Per fiber radius.
    sigma_a: [f64; 3],
    /// Scattering events on the longest path; 1 is direct light alone.
    pub(crate) max_scatter: u32,
}

impl Material {
    /// As a look of ours.
    pub(crate) fn look(&self) -> String {
        format!(
            "model = \"chiang\"\nabsorption = {:?}\nlongitudinal_roughness = {:?}\nazimuthal_roughness = {:?}\n\
             tilt_deg = {:?}\nior = {:?}\n",
            self.sigma_a, self.beta_m, self.beta_n, self.alpha_deg, self.ior
        )
    }
}

/// What is chosen of the lab scene.
pub(crate) struct Choice<'a> {
    pub(crate) light: &'a str,
    /// The lines of `[look.hair]`.
    pub(crate) look: &'a str,
    /// Scattering events.
    pub(crate) max_depth: u32,
    /// Scattering events before Russian roulette; `None`: as usual.
    pub(crate) roulette_start: Option<u32>,
    /// Per pixel.
    pub(crate) samples: u32,
    pub(crate) with_head: bool,
}

impl LabScene {
    /// Reads `scene.json` of the folder.
    pub(crate) fn read(dir: &Path) -> anyhow::Result<Self> {
        let path = dir.join("scene.json");
        let text = std::fs::read_to_string(&path)
            .with_context(|| format!("cannot read {} (gen_groom.py --out-dir writes it)", path.display()))?;
        let scene: Self =
            serde_json::from_str(&text).with_context(|| format!("{} is not the lab's scene", path.display()))?;
        if scene.up != "y" {
            bail!("{}: up is {:?}; the lab's scenes have y up", path.display(), scene.up);
        }
        if scene.camera.pixel_filter != "box 1px" {
            let found = &scene.camera.pixel_filter;
            bail!("{}: the pixel filter is {found:?}; only \"box 1px\" is known", path.display());
        }
        Ok(scene)
    }

    /// The material of that name.
    pub(crate) fn material(&self, name: &str) -> anyhow::Result<&Material> {
        self.materials
            .get(name)
            .with_context(|| format!("the scene has no material {name:?}, but {}", keys(&self.materials)))
    }

    /// The scene as a scene file of ours; the groom's path is relative to the lab's folder.
    pub(crate) fn toml(&self, choice: &Choice<'_>) -> anyhow::Result<String> {
        let unit_m = match self.units.as_str() {
            "mm" => 0.001,
            "cm" => 0.01,
            "m" => 1.0,
            other => bail!("the lab's unit is {other:?}; known are mm, cm and m"),
        };
        let light = self
            .lights
            .get(choice.light)
            .with_context(|| format!("the scene has no light {:?}, but {}", choice.light, keys(&self.lights)))?;
        let camera = &self.camera;
        let mut text = format!(
            "# The lab scene under {}, written by cuticle-validate.\n\n[scene]\nname = \"lab {}\"\nunit_m = {unit_m:?}\n\n",
            choice.light, choice.light
        );
        text += &format!(
            "[camera]\nposition = {:?}\ntarget = {:?}\nup = {:?}\nfov_deg = {:?}\n\n",
            camera.origin, camera.target, camera.up, camera.fov_y_deg
        );
        text += &format!(
            "[film]\nwidth = {}\nheight = {}\nfilter = \"box\"\nfilter_width_px = 1.0\n\n",
            camera.width, camera.height
        );
        text += &format!(
            "[render]\nsamples = {}\nmax_depth = {}\ncurve_shape = \"round\"\ncurve_basis = \"catmull_rom\"\n",
            choice.samples, choice.max_depth
        );
        if let Some(start) = choice.roulette_start {
            text += &format!("roulette_start = {start}\n");
        }
        text += &format!("\n[[light]]\ntype = \"environment\"\nradiance = {:?}\n\n", light.env);
        for rect in &light.rects {
            // The peers' rectangle hides the environment behind it; ours lets it through. The same light
            // arrives when ours emits that much less.
            let radiance = [0, 1, 2].map(|c: usize| rect.radiance[c] - light.env[c]);
            if !rect.one_sided || radiance.iter().any(|&l| l < 0.0) {
                bail!("a rectangle that is two-sided or darker than the environment has no equal of ours");
            }
            text += &format!(
                "[[light]]\ntype = \"rectangle\"\ncenter = {:?}\naim = {:?}\nwidth = {:?}\nheight = {:?}\n\
                 radiance = {radiance:?}\ntwo_sided = false\nvisible = true\n\n",
                rect.center, rect.aim, rect.width, rect.height
            );
        }
        if choice.with_head {
            let Head { center, radius, albedo } = &self.head;
            text += &format!(
                "[[mesh]]\nname = \"head\"\nshape = {{ sphere = {{ center = {center:?}, radius = {radius:?} }} }}\n\
                 albedo = {albedo:?}\n\n"
            );
        }
        // A JSON string is a TOML string too.
        let groom = serde_json::to_string(&self.groom).context("the groom's name")?;
        text += &format!("[[groom]]\nname = \"hair\"\nfile = {groom}\nup = \"y\"\nlook = \"hair\"\n\n");
        text += &format!("[look.hair]\n{}", choice.look);
        Ok(text)
    }
}

fn keys<T>(map: &BTreeMap<String, T>) -> String {
    map.keys().cloned().collect::<Vec<_>>().join(", ")
}

/// Writes the scene file beside the lab's files, where its groom is, and loads it.
pub(crate) fn load(dir: &Path, name: &str, text: &str, overrides: &[String]) -> anyhow::Result<LoadedScene> {
    let path = dir.join(name);
    std::fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
    let scene = job::load(&Source::File(path), overrides)?;
    for warning in &scene.warnings {
        eprintln!("warning: {warning}");
    }
    Ok(scene)
}

/// Renders with a seed.
pub(crate) fn render(scene: &LoadedScene, seed: u32, threads: usize) -> anyhow::Result<Outcome> {
    let mut scene = scene.clone();
    scene.render.seed = seed;
    let options = Options { threads, ..Options::default() };
    Ok(job::render(Arc::new(scene), &options, &Cancel::default(), &mut |_| ())?)
}

/// Millions of samples of pixels per second.
pub(crate) fn rate(outcome: &Outcome) -> f64 {
    let film = &outcome.film;
    let samples = f64::from(outcome.samples) * f64::from(film.width()) * f64::from(film.height());
    samples / outcome.elapsed.as_secs_f64().max(1e-9) / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;

    const JSON: &str = r#"{
        "units": "cm", "up": "y", "groom": "groom.hair",
        "camera": {"origin": [26.0, 8.0, 58.0], "target": [0.0, -3.0, -1.0], "up": [0, 1, 0],
                   "fov_y_deg": 31.0, "width": 64, "height": 32, "pixel_filter": "box 1px"},
        "head": {"center": [0, 0, 0], "radius": 9.5, "albedo": [0.45, 0.35, 0.30]},
        "lights": {"L2": {"env": [0.05, 0.05, 0.05], "rects": [
            {"center": [30.0, 45.0, 40.0], "aim": [0, 0, 0], "width": 20.0, "height": 10.0,
             "radiance": [40.0, 40.0, 40.0], "one_sided": true}]}},
        "materials": {"brown": {"beta_m": 0.3, "beta_n": 0.3, "alpha_deg": 2.0, "ior": 1.55,
                                "sigma_a": [0.5447, 0.9061, 1.781], "max_scatter": 16}}
    }"#;

    /// Two strands of two points, 80 micrometres thick, in centimetres.
    fn groom() -> Vec<u8> {
        let mut bytes = b"HAIR".to_vec();
        for word in [2_u32, 4, 2, 1] {
            bytes.extend(word.to_le_bytes());
        }
        for float in [0.008_f32, 0.0, 0.5, 0.3, 0.2] {
            bytes.extend(float.to_le_bytes());
        }
        bytes.resize(128, 0);
        for x in [0.0_f32, 9.6, 0.0, 0.0, 12.5, 0.1, 1.0, 9.6, 0.0, 1.0, 12.5, 0.3] {
            bytes.extend(x.to_le_bytes());
        }
        bytes
    }

    #[test]
    fn the_scene_of_the_lab_becomes_ours() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("scene.json"), JSON).unwrap();
        std::fs::write(folder.path().join("groom.hair"), groom()).unwrap();
        let lab = LabScene::read(folder.path()).unwrap();
        let brown = lab.material("brown").unwrap();
        let text = lab
            .toml(&Choice {
                light: "L2",
                look: &brown.look(),
                max_depth: brown.max_scatter,
                roulette_start: None,
                samples: 2,
                with_head: true,
            })
            .unwrap();
        assert!(text.contains("\ntilt_deg = 2.0\n") && text.contains("\nabsorption = [0.5447, 0.9061, 1.781]\n"));
        let scene = load(folder.path(), "ours.toml", &text, &[]).unwrap();

        assert_eq!((scene.film.width, scene.film.height, scene.film.filter_width), (64, 32, 1.0));
        assert_eq!((scene.render.samples, scene.render.max_depth), (2, 16));
        assert!((scene.camera.fov_y.to_degrees() - 31.0).abs() < 1e-5);
        assert_eq!((scene.lights.len(), scene.meshes.len(), scene.grooms.len(), scene.looks.len()), (2, 1, 1, 1));
        // Points arrive bit by bit: the mask relies on it.
        assert_eq!(scene.grooms[0].groom.strand(0)[1].to_array(), [0.0, 12.5, 0.1]);
        assert_eq!(scene.grooms[0].groom.strand(1)[1].to_array(), [1.0, 12.5, 0.3]);
        let outcome = render(&scene, 3, 1).unwrap();
        // A corner sees nothing but the environment.
        let corner = outcome.film.pixel(0, 31).beauty();
        assert_eq!((corner[0], outcome.film.rejected(), outcome.samples), (0.05, 0, 2));

        let error = lab.material("green").unwrap_err().to_string();
        assert!(error.contains("green") && error.contains("brown"), "{error}");
    }
}
