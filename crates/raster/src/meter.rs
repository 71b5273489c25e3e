//! What a frame cost: time per pass, bytes per buffer, fragments.

use std::fmt::Write as _;

/// One pass and its time.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    /// The part of the renderer that it belongs to: a technique's name, or `scene`.
    pub owner: &'static str,
    /// The pass.
    pub pass: String,
    /// Time on the device, ms; `None` where it has no timers.
    pub ms: Option<f64>,
}

/// Something that the device keeps for a part of the renderer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Allocation {
    /// The part of the renderer that it belongs to.
    pub owner: &'static str,
    /// What it is.
    pub name: String,
    /// Its size.
    pub bytes: u64,
}

/// What became of the fragments of hair.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Fragments {
    /// Kept by a technique that keeps any.
    pub stored: u64,
    /// Lost for want of memory, of a free semaphore, or of a depth that both passes of the K+-buffer agree about. Not
    /// those that a technique leaves out on purpose.
    pub dropped: u64,
}

/// What a frame cost.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// Passes in their order.
    pub spans: Vec<Span>,
    /// Buffers and textures.
    pub memory: Vec<Allocation>,
    /// Fragments of the transparency technique.
    pub fragments: Fragments,
    /// Wall time from the first command to the last result, ms; the device's times are in `spans`.
    pub wall_ms: f64,
    /// How often the frame was drawn until nothing was dropped.
    pub attempts: u32,
    /// Sentences for the user.
    pub notes: Vec<String>,
}

impl Report {
    /// Time of all passes of `owner`, ms; `None` when any of them was not timed.
    pub fn ms(&self, owner: &str) -> Option<f64> {
        self.spans.iter().filter(|span| span.owner == owner).map(|span| span.ms).sum()
    }

    /// Time of all passes, ms.
    pub fn total_ms(&self) -> Option<f64> {
        self.spans.iter().map(|span| span.ms).sum()
    }

    /// Bytes of `owner`.
    pub fn bytes(&self, owner: &str) -> u64 {
        self.memory.iter().filter(|one| one.owner == owner).map(|one| one.bytes).sum()
    }

    /// All bytes.
    pub fn total_bytes(&self) -> u64 {
        self.memory.iter().map(|one| one.bytes).sum()
    }

    /// As a table for people.
    pub fn table(&self) -> String {
        let mut text = String::new();
        let _ = writeln!(text, "{:<12} {:<28} {:>10}", "part", "pass", "ms");
        for span in &self.spans {
            let ms = span.ms.map_or_else(|| "-".to_owned(), |ms| format!("{ms:.3}"));
            let _ = writeln!(text, "{:<12} {:<28} {ms:>10}", span.owner, span.pass);
        }
        if let Some(ms) = self.total_ms() {
            let _ = writeln!(text, "{:<12} {:<28} {ms:>10.3}", "", "all passes");
        }
        let _ = writeln!(text, "\n{:<12} {:<28} {:>10}", "part", "buffer", "MB");
        for one in &self.memory {
            let _ = writeln!(text, "{:<12} {:<28} {:>10.3}", one.owner, one.name, one.bytes as f64 / 1e6);
        }
        let _ = writeln!(text, "{:<12} {:<28} {:>10.3}", "", "all", self.total_bytes() as f64 / 1e6);
        let _ = writeln!(
            text,
            "\nfragments stored {}, dropped {}; drawn {} time{}",
            self.fragments.stored,
            self.fragments.dropped,
            self.attempts,
            if self.attempts == 1 { "" } else { "s" }
        );
        text
    }

    /// As CSV: `kind,part,name,value` with a header; times in ms, sizes in bytes.
    pub fn csv(&self) -> String {
        let mut text = String::from("kind,part,name,value\n");
        for span in &self.spans {
            let ms = span.ms.map_or_else(String::new, |ms| format!("{ms:.6}"));
            let _ = writeln!(text, "ms,{},{},{ms}", span.owner, quoted(&span.pass));
        }
        for one in &self.memory {
            let _ = writeln!(text, "bytes,{},{},{}", one.owner, quoted(&one.name), one.bytes);
        }
        let _ = writeln!(text, "fragments,transparency,stored,{}", self.fragments.stored);
        let _ = writeln!(text, "fragments,transparency,dropped,{}", self.fragments.dropped);
        text
    }
}

/// A CSV field.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_by_owner_and_unknown_times_stay_unknown() {
        let span = |owner, ms| Span { owner, pass: "a, b".to_owned(), ms };
        let mut report = Report { spans: vec![span("scene", Some(1.0)), span("dom", Some(2.5))], ..Report::default() };
        report.memory.push(Allocation { owner: "dom", name: "depth".to_owned(), bytes: 7 });
        assert_eq!((report.ms("dom"), report.total_ms(), report.bytes("dom")), (Some(2.5), Some(3.5), 7));
        assert!(report.csv().contains("ms,dom,\"a, b\",2.500000\n"), "{}", report.csv());
        report.spans.push(span("dom", None));
        assert_eq!((report.ms("dom"), report.ms("scene")), (None, Some(1.0)));
    }
}
