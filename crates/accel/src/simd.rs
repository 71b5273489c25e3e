use std::fmt;
use std::str::FromStr;

use fearless_simd::{Level, Simd, dispatch};

/// Code that is generic over the instruction set.
pub(crate) trait WithSimd {
    type Output;

    fn with_simd<S: Simd>(self, simd: S) -> Self::Output;
}

/// Which instruction set traversal uses.
#[derive(Clone, Copy, Debug, Default)]
pub enum SimdLevel {
    /// The best that the machine has.
    #[default]
    Auto,
    /// A particular one.
    Fixed(Level),
}

impl SimdLevel {
    /// Every level that this machine has, slowest first.
    pub fn available() -> Vec<Self> {
        let best = Level::new();
        let mut levels = vec![Level::baseline()];
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        {
            levels.extend(best.as_sse4_2().map(Level::Sse4_2));
            levels.extend(best.as_avx2().map(Level::Avx2));
            levels.extend(best.as_avx512().map(Level::Avx512));
        }
        levels.dedup_by_key(|level| format!("{level:?}"));
        if levels.iter().all(|level| format!("{level:?}") != format!("{best:?}")) {
            levels.push(best);
        }
        levels.into_iter().map(Self::Fixed).collect()
    }

    pub(crate) fn resolved(self) -> Self {
        Self::Fixed(self.level())
    }

    fn level(self) -> Level {
        match self {
            Self::Auto => Level::new(),
            Self::Fixed(level) => level,
        }
    }

    /// Runs code that is generic over the instruction set.
    #[inline(always)]
    pub(crate) fn run<W: WithSimd>(self, work: W) -> W::Output {
        dispatch!(self.level(), simd => work.with_simd(simd))
    }
}

impl fmt::Display for SimdLevel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = format!("{:?}", self.level());
        f.write_str(&name.split('(').next().unwrap_or("?").to_lowercase())
    }
}

impl FromStr for SimdLevel {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        if name == "auto" {
            return Ok(Self::Auto);
        }
        let there = Self::available();
        there.iter().copied().find(|level| level.to_string() == name).ok_or_else(|| {
            let names: Vec<_> = there.iter().map(ToString::to_string).collect();
            format!("no SIMD level {name:?} on this machine; there are auto, {}", names.join(", "))
        })
    }
}
