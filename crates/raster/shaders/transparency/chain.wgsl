// What techniques that order fragments share. The chain is a row of registers `chain_0`, `chain_1`, ..: nearest
// first, each (depth bits, where the payload is). Its steps are written out by `chain.rs`.

// Fainter fragments do not count: too many would be needed to be seen. No more than that, because hair far away is
// made of faint ones.
const CHAIN_LEAST_ALPHA: f32 = 1e-6;
// What lies behind is not looked at when less than this gets through.
const CHAIN_OPAQUE: f32 = 1e-4;
// Depth bits of a register that holds nothing: not a number, so behind every depth.
const CHAIN_EMPTY: u32 = 0xffffffffu;

// Some rows of the picture; twin of `Plan::uniform` in `bands.rs`.
struct ChainBand {
    width: u32,
    first: u32,     // row
    capacity: u32,  // fragments
    slot: u32,      // which band
}

// Index of a pixel among those of the band.
fn chain_pixel(band: ChainBand, at: vec2f) -> u32 {
    return (u32(at.y) - band.first) * band.width + u32(at.x);
}

// Bits of a depth, in the order of depths.
fn chain_bits(depth: f32) -> u32 {
    return bitcast<u32>(max(depth, 0.0));
}

// Equal depths go by place, so that two fragments are never in the same place of the order.
fn chain_before(a: vec2u, b: vec2u) -> bool {
    return (a.x < b.x) | ((a.x == b.x) & (a.y < b.y));
}

// Mean of colours that were added with their weights.
fn chain_mean(sum: vec4f) -> vec3f {
    return sum.rgb / max(sum.a, 1e-20);
}
