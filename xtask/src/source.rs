//! What Rust sources say, comments and literals left out.
//!
//! Enough of a lexer to tell code from text; it does not understand the code.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

/// The code of a Rust source: every comment, string and character literal becomes a space. Lines stay where
/// they are.
pub fn code(text: &str) -> String {
    let chars: Vec<char> = text.chars().collect();
    let mut out = String::with_capacity(text.len());
    let mut i = 0;
    while i < chars.len() {
        let end = skipped(&chars, i);
        if end > i {
            out.push(' ');
            out.extend(chars[i..end].iter().filter(|&&c| c == '\n'));
            i = end;
        } else {
            out.push(chars[i]);
            i += 1;
        }
    }
    out
}

/// Where the comment or literal ends that begins at `i`; `i` where none does.
fn skipped(chars: &[char], i: usize) -> usize {
    let at = |i: usize| chars.get(i).copied().unwrap_or('\0');
    let end = match (at(i), at(i + 1)) {
        ('/', '/') => position(chars, i, |c| c == '\n'),
        ('/', '*') => block_end(chars, i),
        ('"', _) => string_end(chars, i + 1),
        ('\'', '\\') => position(chars, i + 3, |c| c == '\'') + 1,
        ('\'', c) if c != '\'' && at(i + 2) == '\'' => i + 3,
        ('r', '"' | '#') if begins_raw(chars, i) => raw_end(chars, i).unwrap_or(i),
        _ => i,
    };
    end.min(chars.len())
}

fn position(chars: &[char], from: usize, is_it: impl Fn(char) -> bool) -> usize {
    let from = from.min(chars.len());
    chars[from..].iter().position(|&c| is_it(c)).map_or(chars.len(), |n| from + n)
}

/// Block comments nest.
fn block_end(chars: &[char], begin: usize) -> usize {
    let (mut i, mut depth) = (begin, 0_u32);
    while i + 1 < chars.len() {
        match (chars[i], chars[i + 1]) {
            ('/', '*') => depth += 1,
            ('*', '/') => depth -= 1,
            _ => {
                i += 1;
                continue;
            }
        }
        i += 2;
        if depth == 0 {
            return i;
        }
    }
    chars.len()
}

fn string_end(chars: &[char], mut i: usize) -> usize {
    while i < chars.len() {
        match chars[i] {
            '\\' => i += 2,
            '"' => return i + 1,
            _ => i += 1,
        }
    }
    chars.len()
}

/// Whether an `r` at `i` is no letter inside a name: `r"`, `br"` and `cr"` are, `for"` is not.
fn begins_raw(chars: &[char], i: usize) -> bool {
    let in_word = |i: Option<usize>| i.is_some_and(|i| is_word(chars[i]));
    let prefix = i.checked_sub(1).filter(|&i| matches!(chars[i], 'b' | 'c'));
    match prefix {
        Some(i) => !in_word(i.checked_sub(1)),
        None => !in_word(i.checked_sub(1)),
    }
}

/// The end of the raw string whose `r` is at `i`; `None` for a raw name such as `r#type`.
fn raw_end(chars: &[char], i: usize) -> Option<usize> {
    let hashes = chars[i + 1..].iter().take_while(|&&c| c == '#').count();
    let mut i = i + 1 + hashes;
    if chars.get(i) != Some(&'"') {
        return None;
    }
    i += 1;
    while i < chars.len() {
        if chars[i] == '"' && chars[i + 1..].iter().take(hashes).filter(|&&c| c == '#').count() == hashes {
            return Some(i + 1 + hashes);
        }
        i += 1;
    }
    Some(chars.len())
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The names, keywords and numbers of code.
pub fn words(code: &str) -> impl Iterator<Item = &str> {
    code.split(|c| !is_word(c)).filter(|word| !word.is_empty())
}

/// The parts of a name in lower case: `SceneGroom` and `scene_groom` both have `scene` and `groom`.
pub fn parts(word: &str) -> Vec<String> {
    let mut parts = vec![String::new()];
    let mut after_lower = false;
    for c in word.chars() {
        if c == '_' || (c.is_uppercase() && after_lower) {
            parts.push(String::new());
        }
        after_lower = !c.is_uppercase() && c != '_';
        if let (true, Some(last)) = (c != '_', parts.last_mut()) {
            last.extend(c.to_lowercase());
        }
    }
    parts.retain(|part| !part.is_empty());
    parts
}

/// All Rust sources below a folder of the workspace, in a fixed order.
///
/// # Errors
/// When a folder cannot be read, or there are none: a check of nothing would always pass.
pub fn rust_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        let entries = std::fs::read_dir(&folder).with_context(|| format!("reading {}", folder.display()))?;
        for entry in entries {
            let path = entry.with_context(|| format!("reading {}", folder.display()))?.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                files.push(path);
            }
        }
    }
    ensure!(!files.is_empty(), "there is no Rust source below {}", folder.display());
    files.sort();
    Ok(files)
}

/// Every place in the code of a file where a banned word stands, as `path:line: word`.
///
/// # Errors
/// When the file cannot be read.
pub fn mentions(file: &Path, is_banned: impl Fn(&str) -> bool) -> Result<Vec<String>> {
    let text = std::fs::read_to_string(file).with_context(|| format!("reading {}", file.display()))?;
    let code = code(&text);
    let mut found = Vec::new();
    for (index, line) in code.lines().enumerate() {
        let banned = words(line).filter(|word| is_banned(word));
        found.extend(banned.map(|word| format!("{}:{}: {word}", file.display(), index + 1)));
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn left(text: &str) -> Vec<String> {
        words(&code(text)).map(str::to_owned).collect()
    }

    #[test]
    fn comments_and_literals_are_no_code() {
        assert_eq!(left("a // b\nc"), ["a", "c"]);
        assert_eq!(left("a /* b /* c */ d */ e"), ["a", "e"]);
        assert_eq!(left(r#"a "b \" c" d"#), ["a", "d"]);
        assert_eq!(left(r##"a r#"b " c"# d"##), ["a", "d"]);
        assert_eq!(left(r###"a br##"c "# d"## e"###), ["a", "b", "e"]);
        assert_eq!(left(r"a 'b' '\'' '\u{62}' c"), ["a", "c"]);
        // A quote in a character does not begin a string, and a lifetime is no character.
        assert_eq!(left("'\"' a '\"'"), ["a"]);
        assert_eq!(left("fn f<'a>(x: &'a str)"), ["fn", "f", "a", "x", "a", "str"]);
        // Neither does an `r` at the end of a name, nor a raw name.
        assert_eq!(left("for\"b\" r#type"), ["for", "r", "type"]);
    }

    #[test]
    fn lines_stay_where_they_are() {
        let text = "a\n/* b\n c */ d\n\"e\nf\" g";
        let lines: Vec<String> = code(text).lines().map(|line| line.trim().to_owned()).collect();
        assert_eq!(lines.len(), text.lines().count());
        assert_eq!(lines[2], "d");
        assert_eq!(lines[4], "g");
    }

    #[test]
    fn what_is_not_closed_ends_with_the_file() {
        for text in ["a /* b", "a \"b", "a \"b\\", "a r#\"b", "a '\\", "a /*/", "'", "r#", "r"] {
            assert!(code(text).len() <= text.len(), "{text}");
        }
    }

    #[test]
    fn names_fall_into_parts() {
        assert_eq!(parts("SceneGroom"), ["scene", "groom"]);
        assert_eq!(parts("read_scene"), ["read", "scene"]);
        assert_eq!(parts("MAX_PIECES"), ["max", "pieces"]);
        assert_eq!(parts("lookup"), ["lookup"]);
    }
}
