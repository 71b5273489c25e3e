use std::fmt;

/// What kind of mistake a [`SceneError`] reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SceneErrorKind {
    /// The text is not TOML.
    Syntax,
    /// A key, a look, a model or another name that does not exist.
    UnknownName,
    /// A value of the wrong type, such as text where a number belongs.
    WrongType,
    /// Something required is not there.
    Missing,
    /// A number outside its range, or one that is not finite.
    OutOfRange,
    /// Keys that exist but do not go together.
    Conflict,
    /// A groom, mesh or environment that could not be had, or is unusable.
    Asset,
    /// An override that is not of the form `path=value` or leads nowhere.
    Override,
}

/// Where in the scene file, or in which override, a mistake is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Line in the file, from 1; always 1 within an override.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// How many characters are marked, at least 1.
    pub width: usize,
    /// The line itself, or the whole override.
    pub excerpt: String,
    /// Whether `excerpt` is an override given with `--set` and not a line of the file.
    pub from_override: bool,
}

impl Place {
    /// The place of the bytes `span` of `text`; a span outside is moved to the end of the text.
    pub(crate) fn within(text: &str, span: std::ops::Range<usize>, from_override: bool) -> Self {
        let start = char_boundary(text, span.start);
        let line_start = text[..start].rfind('\n').map_or(0, |i| i + 1);
        let line_end = text[start..].find('\n').map_or(text.len(), |i| start + i);
        let end = char_boundary(text, span.end.clamp(start, line_end)).max(start);
        Self {
            line: text[..start].matches('\n').count() + 1,
            column: text[line_start..start].chars().count() + 1,
            width: text[start..end].trim_end().chars().count().max(1),
            // Tabs would push the mark below away from its character.
            excerpt: excerpt(text[line_start..line_end].trim_end()),
            from_override,
        }
    }
}

/// A line as a terminal can show it: at most 160 characters, control characters as blanks.
fn excerpt(line: &str) -> String {
    line.chars().take(160).map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// The largest character boundary at or before byte `at`.
fn char_boundary(text: &str, at: usize) -> usize {
    let mut at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

/// Why a scene cannot be rendered: what was found, where, and what would have been right.
///
/// Its `Display` form is several lines when the place is known:
///
/// ```text
/// line 2, column 1: unknown key `look.main.melanine`; did you mean `melanin`?
///   |
/// 2 | melanine = 0.4
///   | ^^^^^^^^
/// ```
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct SceneError {
    /// What kind of mistake it is.
    pub kind: SceneErrorKind,
    /// What is wrong, without place or suggestion.
    pub message: String,
    /// Where it is wrong; `None` where no single place is to blame.
    pub place: Option<Place>,
    /// The name that was probably meant.
    pub suggestion: Option<String>,
}

impl SceneError {
    pub(crate) fn new(kind: SceneErrorKind, message: impl Into<String>) -> Self {
        Self { kind, message: message.into(), place: None, suggestion: None }
    }

    pub(crate) fn at(mut self, place: Option<Place>) -> Self {
        self.place = place;
        self
    }

    pub(crate) fn suggest(mut self, suggestion: Option<&str>) -> Self {
        self.suggestion = suggestion.map(str::to_owned);
        self
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.place {
            Some(place) if place.from_override => write!(f, "in `--set {}`: ", place.excerpt)?,
            Some(place) => write!(f, "line {}, column {}: ", place.line, place.column)?,
            None => {}
        }
        f.write_str(&self.message)?;
        if let Some(name) = &self.suggestion {
            write!(f, "; did you mean `{name}`?")?;
        }
        if let Some(place) = &self.place {
            let number = if place.from_override { String::new() } else { place.line.to_string() };
            let gutter = " ".repeat(number.len());
            let lead = " ".repeat(place.column - 1);
            let mark = "^".repeat(place.width);
            write!(f, "\n{gutter} |\n{number} | {}\n{gutter} | {lead}{mark}", place.excerpt)?;
        }
        Ok(())
    }
}

/// Why an asset could not be had. [`Scene::load`](crate::Scene::load) adds which one was asked for
/// and where.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub struct AssetError {
    /// What went wrong, as one sentence without the path.
    pub message: String,
}

impl AssetError {
    /// An error that says `why`.
    pub fn new(why: impl fmt::Display) -> Self {
        Self { message: why.to_string() }
    }
}

/// The candidate that `name` was probably meant to be.
///
/// Typing errors come first (a few letters wrong for the length of the name), then a candidate that
/// contains the name as a part, as `roughness` is part of `roughness_deg`.
pub(crate) fn closest<'c>(name: &str, candidates: impl IntoIterator<Item = &'c str>) -> Option<&'c str> {
    let allowed = 1 + name.chars().count() / 4;
    let mut best: Option<(usize, &str)> = None;
    for candidate in candidates {
        let mut distance = strsim::damerau_levenshtein(&name.to_lowercase(), &candidate.to_lowercase());
        if distance > allowed {
            let part = name.len() >= 3 && (candidate.contains(name) || name.contains(candidate));
            if !part || candidate.len() < 3 {
                continue;
            }
            // After all typing errors; the first of several parts wins.
            distance = usize::MAX;
        }
        if best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}

/// `` `a`, `b`, `c` ``.
pub(crate) fn quoted_list<'c>(names: impl IntoIterator<Item = &'c str>) -> String {
    let quoted: Vec<String> = names.into_iter().map(|name| format!("`{name}`")).collect();
    quoted.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suggestions_follow_typing_errors_and_parts() {
        let names = ["melanin", "redness", "longitudinal_roughness_deg", "ior"];
        assert_eq!(closest("melanine", names), Some("melanin"));
        assert_eq!(closest("rednses", names), Some("redness"));
        assert_eq!(closest("IOR", names), Some("ior"));
        assert_eq!(closest("roughness", names), Some("longitudinal_roughness_deg"));
        assert_eq!(closest("zebra", names), None);
    }

    #[test]
    fn places_count_lines_and_characters_and_survive_odd_spans() {
        let text = "a = 1\nßü = \"x\"\n";
        let place = Place::within(text, 6..10, false);
        assert_eq!((place.line, place.column, place.width), (2, 1, 2));
        assert_eq!(place.excerpt, "ßü = \"x\"");
        // Inside a two-byte character, and beyond the end.
        assert_eq!(Place::within(text, 7..7, false).column, 1);
        let end = Place::within(text, 900..1000, false);
        assert_eq!((end.line, end.column, end.width), (3, 1, 1));
    }

    #[test]
    fn the_mark_stands_below_the_mistake() {
        let text = "ior = 1\nmelanine = 0.4";
        let error = SceneError::new(SceneErrorKind::UnknownName, "unknown key `melanine`")
            .at(Some(Place::within(text, 8..16, false)))
            .suggest(Some("melanin"));
        assert_eq!(
            error.to_string(),
            "line 2, column 1: unknown key `melanine`; did you mean `melanin`?\n  |\n2 | melanine = 0.4\n  | ^^^^^^^^"
        );
    }
}
