use std::path::{Path, PathBuf};

use groom::UpAxis;

use crate::LoadError;

/// How to look at a groom that comes alone.
#[derive(Clone, Debug)]
pub struct GroomView {
    /// Its up axis; `None`: guessed from the way the strands fall, else y.
    pub up: Option<UpAxis>,
    /// Degrees around the vertical: 0 looks from +z, 90 from +x, after the groom was set upright.
    pub azimuth_deg: f32,
    /// Degrees above the horizon.
    pub elevation_deg: f32,
    /// Metres per unit of the groom and the mesh.
    pub unit_m: f32,
    /// A mesh to put under it, in the groom's own units and axes.
    pub head: Option<PathBuf>,
    /// A lat-long picture that lights it, instead of a key, a rim and a soft sky.
    pub environment: Option<PathBuf>,
}

impl Default for GroomView {
    fn default() -> Self {
        Self { up: None, azimuth_deg: 30.0, elevation_deg: 8.0, unit_m: 0.01, head: None, environment: None }
    }
}

/// The text of a scene around one groom: framed by its own size, lit from infinity, so that units do not
/// matter.
pub(crate) fn text(path: &Path, view: &GroomView) -> Result<String, LoadError> {
    let up = match view.up {
        Some(up) => up,
        None => {
            let file = formats::read_groom(path)?;
            if file.groom.bounds().is_none() {
                return Err(LoadError::Empty { path: path.to_owned(), reason: "there are no strands".into() });
            }
            groom::guess_up(&file.groom).unwrap_or(UpAxis::Y)
        }
    };
    let up = match up {
        UpAxis::X => "x",
        UpAxis::Y => "y",
        UpAxis::Z => "z",
    };
    let quoted = |path: &Path| {
        let path = absolute(path);
        path.to_str().map(toml_string).ok_or_else(|| LoadError::NotText { path: path.clone() })
    };
    let mut text = format!(
        "[scene]\nname = {}\nunit_m = {:?}\n\n[camera]\nfov_deg = 28.0\norbit = {{ azimuth_deg = {:?}, elevation_deg = {:?} }}\n\n",
        toml_string(&path.file_stem().unwrap_or_default().to_string_lossy()),
        view.unit_m,
        view.azimuth_deg,
        view.elevation_deg,
    );
    text += "[film]\nwidth = 800\nheight = 800\nview = \"filmic\"\n\n";
    match &view.environment {
        Some(environment) => {
            text += &format!("[[light]]\ntype = \"environment\"\nfile = {}\n\n", quoted(environment)?);
        }
        None => {
            // Key and rim turn with the camera, so that every view is lit alike.
            let turned = |azimuth: f32, elevation: f32| {
                let (a, e) = ((azimuth + view.azimuth_deg).to_radians(), elevation.to_radians());
                [-e.cos() * a.sin(), -e.sin(), -e.cos() * a.cos()]
            };
            for (direction, irradiance, angle) in
                [(turned(-40.0, 38.0), "[8.5, 7.9, 7.1]", 24.0), (turned(155.0, 30.0), "[5.0, 5.5, 6.4]", 20.0)]
            {
                text += &format!(
                    "[[light]]\ntype = \"distant\"\ndirection = {direction:?}\nirradiance = {irradiance}\nangle_deg = {angle:?}\n\n"
                );
            }
            text += "[[light]]\ntype = \"environment\"\nradiance = [0.34, 0.36, 0.40]\n\n";
        }
    }
    if let Some(head) = &view.head {
        text += &format!(
            "[[mesh]]\nname = \"head\"\nfile = {}\nup = \"{up}\"\nalbedo = [0.45, 0.35, 0.30]\n\n",
            quoted(head)?,
        );
    }
    text += &format!("[[groom]]\nfile = {}\nlook = \"main\"\nup = \"{up}\"\n\n", quoted(path)?);
    text += "[look.main]\nmodel = \"deon\"\npreset = \"brown\"\n";
    Ok(text)
}

fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// A basic TOML string: quotes, backslashes and control characters escaped.
fn toml_string(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            c if c.is_control() => out.push_str(&format!("\\u{:04X}", c as u32)),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_path_survives_the_text() {
        let view = GroomView { up: Some(UpAxis::Z), ..GroomView::default() };
        let path = Path::new("/no such/\"quoted\"\\and\u{7}bell.hair");
        let text = text(path, &view).unwrap();
        let error = scene::Scene::load(&text, &[], &scene::NoAssets).unwrap_err();
        // It got as far as asking for the file, under its own name.
        assert!(error.to_string().contains("quoted"), "{error}");
    }
}
