//! The text behind a scene, so that every later complaint can point into it.
//!
//! Overrides are appended to the text of the file, and their values carry spans into the appended
//! part. So a span alone tells whether the file or an override is to blame.

use std::ops::Range;

use toml::de::{DeArray, DeTable, DeValue};

use crate::error::{Place, SceneError, SceneErrorKind, closest, quoted_list};
use crate::file::SceneFile;
use crate::set;

/// The file's text followed by one line per override.
pub(crate) struct Text {
    all: String,
    file_len: usize,
    overrides: Vec<Range<usize>>,
}

impl Text {
    pub(crate) fn new(file: &str, overrides: &[String]) -> Self {
        let mut all = file.to_owned();
        let mut ranges = Vec::with_capacity(overrides.len());
        for line in overrides {
            all.push('\n');
            let start = all.len();
            all.push_str(line);
            ranges.push(start..all.len());
        }
        Self { all, file_len: file.len(), overrides: ranges }
    }

    fn file(&self) -> &str {
        &self.all[..self.file_len]
    }

    pub(crate) fn place(&self, span: Range<usize>) -> Place {
        for range in &self.overrides {
            if (range.start..=range.end).contains(&span.start) {
                let local = span.start - range.start..span.end.saturating_sub(range.start);
                return Place::within(&self.all[range.clone()], local, true);
            }
        }
        Place::within(self.file(), span, false)
    }

    /// Parses the file and applies the overrides.
    pub(crate) fn parse(&self) -> Result<Source<'_>, SceneError> {
        let mut root = DeTable::parse(self.file())
            .map_err(|error| {
                let place = error.span().map(|span| self.place(span));
                SceneError::new(SceneErrorKind::Syntax, error.message()).at(place)
            })?
            .into_inner();
        for range in &self.overrides {
            set::apply(&mut root, &self.all[range.clone()], range.start).map_err(|fault| {
                SceneError::new(fault.kind, fault.message)
                    .at(Some(self.place(fault.span)))
                    .suggest(fault.suggestion.as_deref())
            })?;
        }
        Ok(Source { text: self, root })
    }
}

/// A parsed scene text: finds the place of any key path.
pub(crate) struct Source<'t> {
    text: &'t Text,
    root: DeTable<'t>,
}

impl Source<'_> {
    /// The typed form of the text.
    pub(crate) fn file(&self) -> Result<SceneFile, SceneError> {
        let root = toml::Spanned::new(0..0, self.root.clone());
        let read: Result<SceneFile, _> = serde::Deserialize::deserialize(toml::Deserializer::from(root));
        read.map_err(|error| self.explain(&error))
    }

    /// A complaint about the value at `path`; where the path ends early, about what holds it.
    pub(crate) fn at_value(&self, kind: SceneErrorKind, path: &str, message: impl Into<String>) -> SceneError {
        let place = find(&self.root, path).map(|found| self.text.place(found.value));
        SceneError::new(kind, message).at(place)
    }

    /// A complaint about the key at `path` itself.
    pub(crate) fn at_key(&self, kind: SceneErrorKind, path: &str, message: impl Into<String>) -> SceneError {
        let place = find(&self.root, path).map(|found| self.text.place(found.key));
        SceneError::new(kind, message).at(place)
    }

    /// Turns the deserialiser's complaint into one with a place and a suggestion.
    fn explain(&self, error: &toml::de::Error) -> SceneError {
        let message = error.message();
        let span = error.span().unwrap_or(0..0);
        let place = (!span.is_empty()).then(|| self.text.place(span.clone()));
        let path = if span.is_empty() { None } else { path_of(&self.root, &span) };
        let mut names = message.split('`').skip(1).step_by(2);
        let first = names.next().unwrap_or_default();
        let candidates: Vec<&str> = names.collect();

        if message.starts_with("unknown field") {
            let path = path.unwrap_or_else(|| first.to_owned());
            let suggestion = closest(first, candidates.iter().copied());
            let hint = match suggestion {
                None if !candidates.is_empty() => {
                    format!("; known here: {}", quoted_list(candidates.iter().copied()))
                }
                _ => String::new(),
            };
            SceneError::new(SceneErrorKind::UnknownName, format!("unknown key `{path}`{hint}"))
                .at(place)
                .suggest(suggestion)
        } else if message.starts_with("unknown variant") {
            let subject = path.map(|path| format!("`{path}`: ")).unwrap_or_default();
            let choice = quoted_list(candidates.iter().copied());
            SceneError::new(
                SceneErrorKind::UnknownName,
                format!("{subject}there is no `{first}`; choose one of {choice}"),
            )
            .at(place)
            .suggest(closest(first, candidates))
        } else if message.starts_with("missing field") {
            let path = path.map(|path| format!(" in `{path}`")).unwrap_or_default();
            SceneError::new(SceneErrorKind::Missing, format!("missing key `{first}`{path}")).at(place)
        } else {
            let subject = path.map(|path| format!("`{path}`: ")).unwrap_or_default();
            SceneError::new(SceneErrorKind::WrongType, format!("{subject}{}", in_words(message))).at(place)
        }
    }
}

/// What serde says about types, without Rust's names for them.
fn in_words(message: &str) -> String {
    let mut text = message.to_owned();
    for (rust, words) in [
        ("integer `", "number `"),
        ("floating point `", "number `"),
        (" as i128", ""),
        (" as i64", ""),
        ("a sequence", "a list"),
        ("sequence", "list"),
        ("u32", "a whole number from 0 to 4294967295"),
        ("u64", "a whole number, 0 or greater"),
        ("f64", "a number"),
        ("map", "table"),
    ] {
        text = text.replace(rust, words);
    }
    // "struct FilmSection" and its like are tables to those who write scenes.
    while let Some(at) = text.find("struct ") {
        let end = text[at + 7..].find(|c: char| !c.is_alphanumeric()).map_or(text.len(), |n| at + 7 + n);
        text.replace_range(at..end, "a table");
    }
    text
}

/// The parts of a key path: `light[1].radiance` and `light.1.radiance` alike.
pub(crate) fn segments(path: &str) -> impl Iterator<Item = &str> {
    path.split(['.', '[', ']']).map(str::trim).filter(|part| !part.is_empty())
}

struct Found {
    key: Range<usize>,
    value: Range<usize>,
}

/// The spans of `path`, or of its longest part that exists.
fn find(root: &DeTable<'_>, path: &str) -> Option<Found> {
    enum Node<'n, 'a> {
        Table(&'n DeTable<'a>),
        Array(&'n DeArray<'a>),
        Leaf,
    }
    let mut node = Node::Table(root);
    let mut found = None;
    for part in segments(path) {
        let next = match node {
            Node::Table(table) => table.get_key_value(part).map(|(key, value)| (key.span(), value)),
            Node::Array(array) => {
                part.parse::<usize>().ok().and_then(|index| array.get(index)).map(|value| (value.span(), value))
            }
            Node::Leaf => None,
        };
        let Some((key, value)) = next else { break };
        found = Some(Found { key, value: value.span() });
        node = match value.get_ref() {
            DeValue::Table(table) => Node::Table(table),
            DeValue::Array(array) => Node::Array(array),
            _ => Node::Leaf,
        };
    }
    found
}

/// The path of the key or value that covers exactly `span`.
fn path_of(table: &DeTable<'_>, span: &Range<usize>) -> Option<String> {
    fn within(value: &toml::Spanned<DeValue<'_>>, span: &Range<usize>) -> Option<String> {
        if value.span() == *span {
            return Some(String::new());
        }
        match value.get_ref() {
            DeValue::Table(table) => path_of(table, span).map(|rest| format!(".{rest}")),
            DeValue::Array(array) => array
                .iter()
                .enumerate()
                .find_map(|(index, value)| within(value, span).map(|rest| format!(".{index}{rest}"))),
            _ => None,
        }
    }
    table.iter().find_map(|(key, value)| {
        // An array of tables carries the span of its first header, and that header is what is meant.
        let inner = match value.get_ref() {
            DeValue::Array(array) => array
                .iter()
                .enumerate()
                .find_map(|(index, value)| within(value, span).map(|rest| format!(".{index}{rest}"))),
            _ => None,
        };
        if let Some(rest) = inner {
            return Some(format!("{key}{rest}"));
        }
        if key.span() == *span {
            return Some(key.to_string());
        }
        within(value, span).map(|rest| format!("{key}{rest}"))
    })
}

/// The line and column, both from 1, of the value at a key path such as `look.main.ior` or
/// `light[1].radiance`; `None` where the path does not lead to a value or the text is not TOML.
pub fn locate(text: &str, path: &str) -> Option<(usize, usize)> {
    let root = DeTable::parse(text).ok()?.into_inner();
    // `find` settles for a part of the path; here only the whole will do.
    let mut steps = segments(path);
    let first = steps.next()?;
    let mut value = root.get(first)?;
    for part in steps {
        value = match value.get_ref() {
            DeValue::Table(table) => table.get(part)?,
            DeValue::Array(array) => array.get(part.parse::<usize>().ok()?)?,
            _ => return None,
        };
    }
    let place = Place::within(text, value.span(), false);
    Some((place.line, place.column))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "[film]\nwidth = 64\n\n[[light]]\ntype = \"point\"\n[[light]]\nradiance = [1, 2]\n\n[look.main]\nior = { value = 1.5 }\n";

    #[test]
    fn key_paths_lead_to_lines() {
        assert_eq!(locate(TEXT, "film.width"), Some((2, 9)));
        assert_eq!(locate(TEXT, "light[1].radiance"), Some((7, 12)));
        assert_eq!(locate(TEXT, "light.1.radiance.1"), Some((7, 16)));
        assert_eq!(locate(TEXT, "look.main.ior.value"), Some((10, 17)));
        assert_eq!(locate(TEXT, "look.main.eta"), None);
        assert_eq!(locate(TEXT, "light[2]"), None);
        assert_eq!(locate("= 3", "a"), None);
    }
}
