//! Tables: for people in Markdown, for programs in CSV.

use raster::AdapterDescription;

/// What stands in one place of a table.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// A word.
    Text(String),
    /// A measured number; NaN where nothing could be measured.
    Number(f64),
    /// A counted number.
    Count(u64),
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<f64> for Cell {
    fn from(x: f64) -> Self {
        Self::Number(x)
    }
}

impl From<u32> for Cell {
    fn from(n: u32) -> Self {
        Self::Count(n.into())
    }
}

impl From<u64> for Cell {
    fn from(n: u64) -> Self {
        Self::Count(n)
    }
}

impl From<Option<f64>> for Cell {
    fn from(x: Option<f64>) -> Self {
        Self::Number(x.unwrap_or(f64::NAN))
    }
}

impl From<Option<u64>> for Cell {
    fn from(n: Option<u64>) -> Self {
        n.map_or(Self::Number(f64::NAN), Self::Count)
    }
}

impl Cell {
    fn markdown(&self) -> String {
        match self {
            Self::Text(text) => escaped(text),
            Self::Number(x) => number(*x),
            Self::Count(n) => grouped(*n),
        }
    }

    fn csv(&self) -> String {
        match self {
            Self::Text(text) if text.contains([',', '"', '\n', '\r']) => format!("\"{}\"", text.replace('"', "\"\"")),
            Self::Text(text) => text.clone(),
            // Nothing is what programs read as missing.
            Self::Number(x) if !x.is_finite() => String::new(),
            Self::Number(x) => x.to_string(),
            Self::Count(n) => n.to_string(),
        }
    }
}

/// Numbers under their names.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// What it tells.
    pub caption: String,
    /// Heads of the columns, with units.
    pub columns: Vec<&'static str>,
    /// Rows, each with as many cells as there are columns.
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    /// An empty table.
    pub fn new<const N: usize>(caption: impl Into<String>, columns: [&'static str; N]) -> Self {
        Self { caption: caption.into(), columns: columns.to_vec(), rows: Vec::new() }
    }

    /// Adds a row.
    pub fn row<const N: usize>(&mut self, cells: [Cell; N]) {
        self.rows.push(cells.to_vec());
    }

    /// For people, caption first.
    pub fn markdown(&self) -> String {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let mut out = format!("{}\n\n", self.caption);
        out += &line(self.columns.iter().map(|head| escaped(head)).collect());
        out += &format!("|{}\n", "---|".repeat(self.columns.len()));
        for row in &self.rows {
            out += &line(row.iter().map(Cell::markdown).collect());
        }
        out
    }

    /// For programs: all digits, a line of heads first. Every row ends with the adapter and whether it is a software
    /// adapter, so that its numbers are not taken for those of a GPU when they are away from their page.
    pub fn csv(&self, adapter: &AdapterDescription) -> String {
        let heads = self.columns.iter().map(|head| Cell::from(*head).csv()).collect::<Vec<_>>().join(",");
        let mut out = format!("{heads}{ADAPTER_HEADS}\n");
        let whose = format!(",{},{}", Cell::from(adapter.name.as_str()).csv(), adapter.software);
        for row in &self.rows {
            out += &row.iter().map(Cell::csv).collect::<Vec<_>>().join(",");
            out += &whose;
            out.push('\n');
        }
        out
    }
}

/// How the heads of every CSV end.
pub(crate) const ADAPTER_HEADS: &str = ",adapter,software";

/// A number for people: three digits that matter; `-` for what is none.
pub fn number(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 {
        "0".into()
    } else if !x.is_finite() {
        "-".into()
    } else if !(1e-4..1e6).contains(&size) {
        format!("{x:.2e}")
    } else {
        let decimals = (2 - size.log10().floor() as i32).clamp(0, 6) as usize;
        format!("{x:.decimals$}")
    }
}

/// Digits in groups of three.
pub(crate) fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

/// Text that fits into a cell, and into a comment.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('|', "\\|").replace('\n', " ").replace("-->", "->")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn adapter(name: &str, software: bool) -> AdapterDescription {
        AdapterDescription { name: name.into(), backend: "Vulkan".into(), driver: String::new(), software }
    }

    #[test]
    fn a_table_is_told_to_people_and_to_programs() {
        let mut table = Table::new("Times.", ["what", "ms", "fragments"]);
        table.row(["a|b, \"c\"".into(), 12.3456_f64.into(), 12_959_208_u64.into()]);
        table.row(["lost".into(), f64::NAN.into(), None::<u64>.into()]);
        let want = "Times.\n\n| what | ms | fragments |\n|---|---|---|\n| a\\|b, \"c\" | 12.3 | 12,959,208 |\n| lost | - | - |\n";
        assert_eq!(table.markdown(), want);
        let want = "what,ms,fragments,adapter,software\n\"a|b, \"\"c\"\"\",12.3456,12959208,\"soft, 256 bits\",true\n\
                    lost,,,\"soft, 256 bits\",true\n";
        assert_eq!(table.csv(&adapter("soft, 256 bits", true)), want);
        assert!(table.csv(&adapter("card", false)).ends_with("lost,,,card,false\n"));
    }

    #[test]
    fn numbers_keep_three_digits() {
        for (x, want) in [
            (0.0, "0"),
            (150.46, "150"),
            (6.3, "6.30"),
            (0.394, "0.394"),
            (0.01234, "0.0123"),
            (1234.5, "1234"),
            (1e-7, "1.00e-7"),
            (f64::INFINITY, "-"),
        ] {
            assert_eq!(number(x), want);
        }
        assert_eq!(
            (grouped(7), grouped(999), grouped(1000), grouped(50_000)),
            ("7".into(), "999".into(), "1,000".into(), "50,000".into())
        );
    }
}
