// Sums that do not depend on the order of their terms: colours with a weight that falls with depth, and the optical
// depth of all fragments.

struct WeightedSums {
    @location(0) color: vec4f,  // w α rgb, w α
    @location(1) depth: f32,    // -ln(1 - α)
}

// Equation 10 of the paper, with depth linear between the clipping planes and divided by 375: the largest weight is
// 8, so that a sum of thousands of bright fragments is still a half float. Only ratios of weights matter.
fn weighted_weight(depth: f32) -> f32 {
    let near = 1.0 - clamp((depth - view.near) / (view.far - view.near), 0.0, 1.0);
    return 8.0 * max(near * near * near, 3.3e-6);
}

@fragment
fn weighted_sum(v: HairVertex) -> WeightedSums {
    let f = hair_fragment(v);
    if f.alpha <= 0.0 || view_hidden(v.clip) {
        discard;
    }
    // The paper's weight has α as a factor, and its colours are premultiplied by it.
    let weight = f.alpha * weighted_weight(f.depth);
    let color = clamp(shade(f), vec3f(0.0), vec3f(60000.0));
    let sums = min(vec4f(color, 1.0) * (f.alpha * weight), vec4f(60000.0));
    return WeightedSums(sums, fragment_optical_depth(f.alpha));
}
