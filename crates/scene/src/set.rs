//! Overrides: `look.main.eumelanin=0.3`, `light[1].radiance=[1,1,1]`, `groom.0.look=main`.
//!
//! An override is applied to the parsed text before it gets types, so what may be written in the
//! file may be written here, and a mistake is found by the same checks.

use std::borrow::Cow;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

use crate::error::{SceneErrorKind, closest, quoted_list};

/// Why an override could not be applied; the span is one of the whole text.
pub(crate) struct Fault {
    pub(crate) kind: SceneErrorKind,
    pub(crate) message: String,
    pub(crate) span: Range<usize>,
    pub(crate) suggestion: Option<String>,
}

impl Fault {
    fn new(kind: SceneErrorKind, span: Range<usize>, message: impl Into<String>) -> Self {
        Self { kind, message: message.into(), span, suggestion: None }
    }
}

/// One part of the path, and where it stands.
type Part<'t> = (&'t str, Range<usize>);

/// Applies one override, whose text begins at byte `offset` of the whole text.
pub(crate) fn apply<'t>(root: &mut DeTable<'t>, line: &'t str, offset: usize) -> Result<(), Fault> {
    let whole = offset..offset + line.len();
    let Some((path, raw)) = line.split_once('=') else {
        let message = "an override is written `path=value`, such as `look.main.ior=1.5`";
        return Err(Fault::new(SceneErrorKind::Override, whole, message));
    };
    let parts = parts(path, offset);
    if parts.is_empty() || raw.trim().is_empty() {
        let message = "an override needs a path before the `=` and a value after it";
        return Err(Fault::new(SceneErrorKind::Override, whole, message));
    }
    let value = parse_value(raw, offset + path.len() + 1)?;
    put(root, "", &parts, value)
}

/// Splits a path at dots and brackets, keeping the place of each part.
fn parts(path: &str, offset: usize) -> Vec<Part<'_>> {
    let mut parts = Vec::new();
    let mut start = 0;
    for piece in path.split(['.', '[', ']']) {
        let lead = piece.len() - piece.trim_start().len();
        let name = piece.trim();
        if !name.is_empty() {
            let at = offset + start + lead;
            parts.push((name, at..at + name.len()));
        }
        // Each separator is one byte.
        start += piece.len() + 1;
    }
    parts
}

/// The value as TOML; what is no TOML is text without its quotes.
fn parse_value(raw: &str, offset: usize) -> Result<Spanned<DeValue<'_>>, Fault> {
    let text = raw.trim();
    let offset = offset + (raw.len() - raw.trim_start().len());
    match DeValue::parse(text) {
        Ok(value) => Ok(shifted(value, offset)),
        // These begin something that was not finished; as bare text they would only puzzle.
        Err(error) if text.starts_with(['[', '{', '"', '\'']) => {
            let span = error.span().unwrap_or(0..text.len());
            let span = span.start + offset..span.end + offset;
            Err(Fault::new(SceneErrorKind::Syntax, span, error.message()))
        }
        Err(_) => Ok(Spanned::new(offset..offset + text.len(), DeValue::String(Cow::Borrowed(text)))),
    }
}

/// The same value with all its spans moved by `by` bytes.
fn shifted(value: Spanned<DeValue<'_>>, by: usize) -> Spanned<DeValue<'_>> {
    let span = value.span().start + by..value.span().end + by;
    let value = match value.into_inner() {
        DeValue::Array(array) => {
            DeValue::Array(array.into_iter().map(|value| shifted(value, by)).collect::<DeArray<'_>>())
        }
        DeValue::Table(table) => DeValue::Table(
            table
                .into_iter()
                .map(|(key, value)| {
                    let span = key.span().start + by..key.span().end + by;
                    (Spanned::new(span, key.into_inner()), shifted(value, by))
                })
                .collect::<DeTable<'_>>(),
        ),
        scalar => scalar,
    };
    Spanned::new(span, value)
}

fn empty_table<'t>(span: Range<usize>) -> Spanned<DeValue<'t>> {
    Spanned::new(span, DeValue::Table(DeTable::new()))
}

/// Puts `value` at `parts` below `table`, whose own path is `above` (with a dot at its end).
fn put<'t>(table: &mut DeTable<'t>, above: &str, parts: &[Part<'t>], value: Spanned<DeValue<'t>>) -> Result<(), Fault> {
    let Some(((name, span), rest)) = parts.split_first() else { return Ok(()) };
    let key = Spanned::new(span.clone(), Cow::Borrowed(*name));
    if rest.is_empty() {
        // The old key goes too, so that complaints point at the override.
        table.remove(*name);
        table.insert(key, value);
        return Ok(());
    }
    if !table.contains_key(*name) {
        if rest[0].0.parse::<usize>().is_ok() {
            let message = format!("the scene has no `{above}{name}`");
            return Err(Fault::new(SceneErrorKind::Override, span.clone(), message));
        }
        // A misspelt look would otherwise become a new one that nothing uses.
        if above == "look." {
            let names: Vec<&str> = table.keys().map(|key| key.get_ref().as_ref()).collect();
            let mut fault = Fault::new(
                SceneErrorKind::UnknownName,
                span.clone(),
                format!("there is no look `{name}`; the scene has {}", quoted_list(names.iter().copied())),
            );
            fault.suggestion = closest(name, names).map(str::to_owned);
            return Err(fault);
        }
    }
    let here = format!("{above}{name}");
    let slot = table.entry(key).or_insert_with(|| empty_table(span.clone()));
    descend(slot, &here, rest, value)
}

/// Puts `value` at `rest` within `slot`, whose path is `here`.
fn descend<'t>(
    slot: &mut Spanned<DeValue<'t>>,
    here: &str,
    rest: &[Part<'t>],
    value: Spanned<DeValue<'t>>,
) -> Result<(), Fault> {
    let Some(((name, span), below)) = rest.split_first() else {
        *slot = value;
        return Ok(());
    };
    // `look.main.ior.random=0.1` on a plain `ior = 1.5`: the number becomes the `value` of a table.
    let is_parameter = here.starts_with("look.") && here.split('.').count() == 3;
    let is_plain = !matches!(slot.get_ref(), DeValue::Table(_))
        && !matches!(slot.get_ref(), DeValue::Array(_) if name.parse::<usize>().is_ok());
    if is_parameter && is_plain {
        let old = std::mem::replace(slot, empty_table(span.clone()));
        if let DeValue::Table(table) = slot.get_mut() {
            table.insert(Spanned::new(old.span(), Cow::Borrowed("value")), old);
        }
    }
    match slot.get_mut() {
        DeValue::Table(table) => put(table, &format!("{here}."), rest, value),
        DeValue::Array(array) => {
            let index = element(array, here, name, span)?;
            match array.get_mut(index) {
                Some(slot) => descend(slot, &format!("{here}.{index}"), below, value),
                None => Ok(()),
            }
        }
        other => Err(Fault::new(
            SceneErrorKind::Override,
            span.clone(),
            format!("`{here}` is a plain {}, there is no `{name}` in it", other.type_str()),
        )),
    }
}

/// The index that `name` means in an array: a number, or the `name` of one of its tables.
fn element(array: &DeArray<'_>, here: &str, name: &str, span: &Range<usize>) -> Result<usize, Fault> {
    let names: Vec<&str> = array
        .iter()
        .map(|value| value.get_ref().get("name").and_then(|name| name.get_ref().as_str()))
        .map(Option::unwrap_or_default)
        .collect();
    let index = match name.parse::<usize>() {
        Ok(index) => Some(index).filter(|&index| index < array.len()),
        Err(_) => names.iter().position(|&known| known == name),
    };
    index.ok_or_else(|| {
        let count = array.len();
        let mut fault = Fault::new(
            SceneErrorKind::Override,
            span.clone(),
            format!("there is no `{here}[{name}]`; `{here}` has {count} entries, counted from 0"),
        );
        let known = names.iter().copied().filter(|name| !name.is_empty());
        fault.suggestion = closest(name, known).map(str::to_owned);
        fault
    })
}
