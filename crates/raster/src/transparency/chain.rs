//! A row of registers that keeps fragments in order, written out step by step.
//!
//! Sorting with loops over an array in private memory is slow where such an array does not fit the registers, and on
//! one driver it was wrong when it happened inside the loop over a list. So shaders have lines such as
//! ``// <put `carry` into the chain>``, which are replaced here by one step for each register.

use std::fmt::Write as _;

/// What templates share: thresholds, order, bands.
const SHARED: &str = include_str!("../../shaders/transparency/chain.wgsl");

/// A label for each number of fragments `0..=16`: pipelines are cached by label, and their text depends on it.
macro_rules! by_count {
    ($name:literal) => {
        [
            concat!($name, " 0"),
            concat!($name, " 1"),
            concat!($name, " 2"),
            concat!($name, " 3"),
            concat!($name, " 4"),
            concat!($name, " 5"),
            concat!($name, " 6"),
            concat!($name, " 7"),
            concat!($name, " 8"),
            concat!($name, " 9"),
            concat!($name, " 10"),
            concat!($name, " 11"),
            concat!($name, " 12"),
            concat!($name, " 13"),
            concat!($name, " 14"),
            concat!($name, " 15"),
            concat!($name, " 16"),
        ]
    };
}
pub(crate) use by_count;

/// Longest chain; more registers would be put into memory after all.
pub(crate) const LONGEST: u32 = 16;

/// The shared text, and `templates` with chains of `length` registers, `1..=16`.
pub(crate) fn text(length: u32, templates: &[&str]) -> String {
    let n = length.clamp(1, LONGEST);
    let (mut declare, mut put, mut take) = (String::new(), String::new(), String::new());
    for i in 0..n {
        let _ = writeln!(declare, "    var chain_{i} = vec2u(CHAIN_EMPTY);");
        let _ = writeln!(put, "    let before_{i} = chain_before(carry, chain_{i});");
        let _ = writeln!(put, "    let nearer_{i} = select(chain_{i}, carry, before_{i});");
        let _ = writeln!(put, "    carry = select(carry, chain_{i}, before_{i});");
        let _ = writeln!(put, "    chain_{i} = nearer_{i};");
        let next = if i + 1 < n { format!("chain_{}", i + 1) } else { "vec2u(CHAIN_EMPTY)".to_owned() };
        let _ = writeln!(take, "    chain_{i} = {next};");
    }
    let mut text = format!("{SHARED}\nconst CHAIN_LENGTH: u32 = {n}u;\n\n");
    for template in templates {
        text.push_str(
            &template
                .replace("// <declare the chain>", declare.trim())
                .replace("// <put `carry` into the chain>", put.trim())
                .replace("// <take the nearest from the chain>", take.trim())
                .replace("chain_last", &format!("chain_{}", n - 1)),
        );
        text.push('\n');
    }
    text
}

/// Fragments of each pixel, nearest first: depth bits and payload.
#[cfg(test)]
pub(crate) type Lists = Vec<Vec<(u32, [u32; 2])>>;

/// What tests put in the place of strands and shading.
#[cfg(test)]
pub(crate) mod stubs {
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    use crate::stage::{FRAGMENT, FRAME, SCREEN};

    /// In the place of the strands' text.
    pub(crate) const STRANDS: &str = "
        struct HairVertex { @builtin(position) @invariant clip: vec4f, @location(0) depth: f32 }
        fn hair_fragment(v: HairVertex) -> Fragment {
            return Fragment(vec3f(0.0), v.depth, vec3f(1.0, 0.0, 0.0), 0.5, 0.0, 1.0, 0.0, 0u, 0u);
        }
    ";

    /// In the place of the shading text.
    pub(crate) const SHADING: &str = "
        fn fragment_payload(f: Fragment) -> vec2u { return vec2u(bitcast<u32>(f.alpha), f.entry); }
        fn payload_color(payload: vec2u, pixel: vec2f, depth: f32) -> vec4f {
            return vec4f(vec3f(depth), bitcast<f32>(payload.x));
        }
        fn payload_alpha(payload: vec2u) -> f32 { return bitcast<f32>(payload.x); }
    ";

    /// Checks the text of a pass over the hair: names of its fragment entry points, or what is wrong.
    pub(crate) fn hair(part: &str) -> Result<Vec<String>, String> {
        check(&[FRAME, FRAGMENT, STRANDS, SHADING, part].join("\n"))
    }

    /// Checks the text of a pass over all pixels.
    pub(crate) fn screen(part: &str) -> Result<Vec<String>, String> {
        check(&[FRAME, FRAGMENT, SCREEN, SHADING, part].join("\n"))
    }

    fn check(text: &str) -> Result<Vec<String>, String> {
        let module = naga::front::wgsl::parse_str(text).map_err(|error| error.emit_to_string(text))?;
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
        validator.validate(&module).map_err(|error| error.emit_to_string(text))?;
        Ok(module
            .entry_points
            .iter()
            .filter(|point| point.stage == naga::ShaderStage::Fragment)
            .map(|point| point.name.clone())
            .collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn get(state: &[(String, [u32; 2])], name: &str) -> [u32; 2] {
        let found = state.iter().find(|(known, _)| known == name);
        found.map(|(_, value)| *value).unwrap_or_else(|| panic!("{name} is not known"))
    }

    /// Runs the written-out lines on numbers: they are assignments and nothing else.
    fn run(lines: &str, state: &mut Vec<(String, [u32; 2])>) {
        for line in lines.lines().map(str::trim).filter(|line| !line.is_empty()) {
            let (to, from) = line.trim_end_matches(';').split_once(" = ").expect("an assignment");
            let to = to.trim_start_matches("let ").trim_start_matches("var ").to_owned();
            let inside = from.split_once('(').map(|(_, rest)| rest.trim_end_matches(')'));
            let parts: Vec<&str> = inside.unwrap_or_default().split(", ").collect();
            let value = if from.starts_with("vec2u(") {
                [u32::MAX; 2]
            } else if from.starts_with("chain_before(") {
                [u32::from(get(state, parts[0]) < get(state, parts[1])), 0]
            } else if from.starts_with("select(") {
                get(state, parts[get(state, parts[2])[0] as usize])
            } else {
                get(state, from)
            };
            state.retain(|(known, _)| *known != to);
            state.push((to, value));
        }
    }

    #[test]
    fn a_chain_keeps_the_nearest_in_order_and_hands_out_the_rest() {
        for n in [1_u32, 2, 5, 16] {
            let template =
                "// <declare the chain>\n#\n// <put `carry` into the chain>\n#\n// <take the nearest from the chain>";
            let whole = text(n, &[template]);
            let (_, mine) = whole.split_once(&format!("= {n}u;\n\n")).expect("the length stands in front");
            let [declare, put, take] = mine.split("#\n").collect::<Vec<_>>()[..] else { panic!("{mine}") };
            let mut state = Vec::new();
            run(declare, &mut state);
            // Few depths, so that there are ties.
            let depths: Vec<[u32; 2]> = (0..40).map(|i| [math::hash::mix(i) % 13, i]).collect();
            let mut out = Vec::new();
            for &depth in &depths {
                state.retain(|(name, _)| name != "carry");
                state.push(("carry".to_owned(), depth));
                run(put, &mut state);
                let carry = get(&state, "carry");
                if carry != [u32::MAX; 2] {
                    out.push(carry);
                }
            }
            let mut sorted = depths.clone();
            sorted.sort_unstable();
            let mut kept = Vec::new();
            for _ in 0..n {
                kept.push(get(&state, "chain_0"));
                run(take, &mut state);
            }
            assert_eq!(kept, sorted[..n as usize], "{n} registers");
            out.sort_unstable();
            assert_eq!(out, sorted[n as usize..], "{n} registers");
            assert_eq!(get(&state, "chain_0"), [u32::MAX; 2]);
        }
    }

    #[test]
    fn labels_differ() {
        let labels: std::collections::BTreeSet<&str> = by_count!("x").into_iter().collect();
        assert_eq!(labels.len(), LONGEST as usize + 1);
    }
}
