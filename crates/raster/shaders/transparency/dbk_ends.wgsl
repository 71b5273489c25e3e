// The depth at which each pixel's layer ends: 0 where there is no hair.

// Twin of `Numbers` in `dbk.rs`.
struct DbkNumbers {
    wanted: f32,  // optical depth that the layer is to have
    shift: f32,   // its thickness where that is fixed, scene units
    edges: array<vec4f, 3>,  // farther ends of the bins, behind the nearest fragment, scene units; increasing
}

@group(3) @binding(0) var<uniform> dbk_numbers: DbkNumbers;
@group(3) @binding(1) var dbk_nearest_depths: texture_2d<f32>;
@group(3) @binding(2) var dbk_bins_a: texture_2d<f32>;
@group(3) @binding(3) var dbk_bins_b: texture_2d<f32>;
@group(3) @binding(4) var dbk_bins_c: texture_2d<f32>;

// Behind all hair.
const DBK_ALL: f32 = 3.0e38;

// Depths are computed anew by each pass and may differ in their last digits.
const DBK_ROUNDING: f32 = 1.0e-6;

// How far the search has come.
struct DbkSearch {
    sum: f32,    // optical depth so far
    begin: f32,  // of the next bin
    shift: f32,  // the thickness that was found; negative: none yet
}

// Twin of `search` in the tests of `dbk.rs`. Density is taken to rise in proportion to depth within a bin, so that
// the sum rises with the square: this errs towards thicker layers.
fn dbk_search_bin(s: DbkSearch, amount: f32, edge: f32, most: f32) -> DbkSearch {
    let end = max(min(edge, most), s.begin);
    var shift = s.shift;
    if shift < 0.0 && amount > 0.0 && s.sum + amount >= dbk_numbers.wanted {
        shift = s.begin + (end - s.begin) * sqrt((dbk_numbers.wanted - s.sum) / amount);
    }
    return DbkSearch(s.sum + amount, end, shift);
}

fn dbk_search_four(s: DbkSearch, amounts: vec4f, edges: vec4f, most: f32) -> DbkSearch {
    var next = dbk_search_bin(s, amounts.x, edges.x, most);
    next = dbk_search_bin(next, amounts.y, edges.y, most);
    next = dbk_search_bin(next, amounts.z, edges.z, most);
    return dbk_search_bin(next, amounts.w, edges.w, most);
}

@fragment
fn dbk_ends_fixed(@builtin(position) at: vec4f) -> @location(0) f32 {
    let nearest = textureLoad(dbk_nearest_depths, vec2i(at.xy), 0).x;
    return select(0.0, nearest * (1.0 + DBK_ROUNDING) + dbk_numbers.shift, nearest > 0.0);
}

@fragment
fn dbk_ends_automatic(@builtin(position) at: vec4f) -> @location(0) f32 {
    let pixel = vec2i(at.xy);
    let nearest = textureLoad(dbk_nearest_depths, pixel, 0).x;
    let most = view.far - nearest;
    let edges = dbk_numbers.edges;
    var s = DbkSearch(0.0, 0.0, -1.0);
    s = dbk_search_four(s, textureLoad(dbk_bins_a, pixel, 0), edges[0], most);
    s = dbk_search_four(s, textureLoad(dbk_bins_b, pixel, 0), edges[1], most);
    s = dbk_search_four(s, textureLoad(dbk_bins_c, pixel, 0), edges[2], most);
    let end = select(nearest * (1.0 + DBK_ROUNDING) + s.shift, DBK_ALL, s.shift < 0.0);
    return select(0.0, end, nearest > 0.0);
}
