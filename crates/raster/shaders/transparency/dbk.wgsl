// Where hair begins, and how its optical depth is spread behind that.

// Twin of `Numbers` in `dbk.rs`.
struct DbkNumbers {
    wanted: f32,  // optical depth that the layer is to have
    shift: f32,   // its thickness where that is fixed, scene units
    edges: array<vec4f, 3>,  // farther ends of the bins, behind the nearest fragment, scene units; increasing
}

// What the three targets of `dbk_bins` add up: optical depth by bin.
struct DbkBins {
    @location(0) a: vec4f,
    @location(1) b: vec4f,
    @location(2) c: vec4f,
}

@group(3) @binding(0) var<uniform> dbk_numbers: DbkNumbers;
@group(3) @binding(1) var dbk_nearest_depths: texture_2d<f32>;

// The amount at the place of the bin that holds `d`, if it is one of four that begin at `begin`.
fn dbk_binned(d: f32, begin: f32, ends: vec4f, amount: f32) -> vec4f {
    let at = vec4f(d);
    return select(vec4f(0.0), vec4f(amount), (at <= ends) & (at > vec4f(begin, ends.xyz)));
}

@fragment
fn dbk_nearest(v: HairVertex) -> @location(0) f32 {
    let f = hair_fragment(v);
    if f.alpha < CHAIN_LEAST_ALPHA || view_hidden(v.clip) {
        discard;
    }
    return f.depth;
}

@fragment
fn dbk_bins(v: HairVertex) -> DbkBins {
    let f = hair_fragment(v);
    if f.alpha < CHAIN_LEAST_ALPHA || view_hidden(v.clip) {
        discard;
    }
    // Nothing is in front of the nearest fragment, but numbers are rounded.
    let d = max(f.depth - textureLoad(dbk_nearest_depths, vec2i(v.clip.xy), 0).x, 0.0);
    let amount = fragment_optical_depth(f.alpha);
    let edges = dbk_numbers.edges;
    return DbkBins(
        dbk_binned(d, -1.0, edges[0], amount),
        dbk_binned(d, edges[0].w, edges[1], amount),
        dbk_binned(d, edges[1].w, edges[2], amount),
    );
}
