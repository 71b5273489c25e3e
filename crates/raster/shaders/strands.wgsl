// Strands become ribbons or lines. Nothing but points is stored: a vertex finds its place on the curve by its index.
//
// Neighbouring pieces share their vertices to the bit: a place at a point of the strand is computed by `hair_knot`
// from that point and its neighbours, whichever piece asks. So no pixel is covered twice or left out at a joint.

// Twin of `HairGeometry` in `strands.rs`.
struct HairGeometry {
    width: f32,         // what radii are multiplied by, because strands are left out
    opacity: f32,       // [0, 1]
    subdivisions: u32,  // pieces between two points
    curved: u32,        // 1: Catmull-Rom spans; 0: straight ones
    slanted: u32,       // 1: the device gives a line one pixel for each row or column; 0: as many as it is long
}

@group(1) @binding(0) var<uniform> hair_geometry: HairGeometry;
// Positions and radii.
@group(1) @binding(1) var<storage, read> hair_points: array<vec4f>;
// Per point: the strand; entry of the palette (bits 0-15), root (16), tip (17), place along the strand (18-31).
@group(1) @binding(2) var<storage, read> hair_marks: array<vec2u>;
// First point of each span, in the order of drawing.
@group(1) @binding(3) var<storage, read> hair_order: array<u32>;

struct HairVertex {
    @builtin(position) @invariant clip: vec4f,
    @location(0) position: vec3f,
    @location(1) tangent: vec3f,
    // Offset across (2 on lines, which have no width), alpha, diameter in pixels, place along the strand.
    @location(2) across: vec4f,
    // Strand and entry.
    @location(3) @interpolate(flat) name: vec2u,
}

// A place on a strand.
struct HairPlace {
    position: vec3f,
    radius: f32,
    tangent: vec3f,  // unit
    u: f32,
}

fn hair_unit(v: vec3f, otherwise: vec3f) -> vec3f {
    let length2 = dot(v, v);
    if length2 > 1e-30 {
        return v * inverseSqrt(length2);
    }
    return otherwise;
}

fn hair_is_root(mark: vec2u) -> bool {
    return (mark.y & 0x10000u) != 0u;
}

fn hair_is_tip(mark: vec2u) -> bool {
    return (mark.y & 0x20000u) != 0u;
}

fn hair_u(mark: vec2u) -> f32 {
    return f32(mark.y >> 18u) / 16383.0;
}

// The place at a point: Catmull-Rom tangents run from the neighbour before to the one behind; where straight pieces
// meet the mean of their directions serves both.
fn hair_knot(k: u32) -> HairPlace {
    let mark = hair_marks[k];
    let here = hair_points[k];
    let before = hair_points[select(k - 1u, k, hair_is_root(mark))].xyz;
    let after = hair_points[select(k + 1u, k, hair_is_tip(mark))].xyz;
    var along = after - before;
    if hair_geometry.curved == 0u {
        along = hair_unit(here.xyz - before, vec3f(0.0)) + hair_unit(after - here.xyz, vec3f(0.0));
    }
    // A strand that turns back on itself, or points that coincide.
    let straight = hair_unit(after - here.xyz, hair_unit(here.xyz - before, vec3f(1.0, 0.0, 0.0)));
    return HairPlace(here.xyz, here.w, hair_unit(along, straight), hair_u(mark));
}

// The place at `t` of the Catmull-Rom span that begins at point `k`. Beyond its ends a strand goes on straight; radii
// are interpolated straight too. As the path tracer has it.
fn hair_between(k: u32, t: f32) -> HairPlace {
    let marks = array<vec2u, 2>(hair_marks[k], hair_marks[k + 1u]);
    let b = hair_points[k];
    let c = hair_points[k + 1u];
    var a = b.xyz + b.xyz - c.xyz;
    var d = c.xyz + c.xyz - b.xyz;
    if !hair_is_root(marks[0]) {
        a = hair_points[k - 1u].xyz;
    }
    if !hair_is_tip(marks[1]) {
        d = hair_points[k + 2u].xyz;
    }
    let t2 = t * t;
    let t3 = t2 * t;
    let position = a * (-0.5 * t3 + t2 - 0.5 * t) + b.xyz * (1.5 * t3 - 2.5 * t2 + 1.0)
        + c.xyz * (-1.5 * t3 + 2.0 * t2 + 0.5 * t) + d * (0.5 * t3 - 0.5 * t2);
    let along = a * (-1.5 * t2 + 2.0 * t - 0.5) + b.xyz * (4.5 * t2 - 5.0 * t)
        + c.xyz * (-4.5 * t2 + 4.0 * t + 0.5) + d * (1.5 * t2 - t);
    let straight = hair_unit(c.xyz - b.xyz, vec3f(1.0, 0.0, 0.0));
    let u = mix(hair_u(marks[0]), hair_u(marks[1]), t);
    return HairPlace(position, mix(b.w, c.w, t), hair_unit(along, straight), u);
}

// The place `joint` pieces behind point `k`.
fn hair_place(k: u32, joint: u32) -> HairPlace {
    if joint == 0u {
        return hair_knot(k);
    }
    if joint >= hair_geometry.subdivisions {
        return hair_knot(k + 1u);
    }
    return hair_between(k, f32(joint) / f32(hair_geometry.subdivisions));
}

// Its position alone.
fn hair_position(k: u32, joint: u32) -> vec3f {
    if joint == 0u {
        return hair_points[k].xyz;
    }
    if joint >= hair_geometry.subdivisions {
        return hair_points[k + 1u].xyz;
    }
    return hair_between(k, f32(joint) / f32(hair_geometry.subdivisions)).position;
}

// What shading is to take for the tangent: on straight pieces their own direction.
fn hair_shading_tangent(k: u32, place: HairPlace) -> vec3f {
    if hair_geometry.curved == 1u {
        return place.tangent;
    }
    return hair_unit(hair_points[k + 1u].xyz - hair_points[k].xyz, place.tangent);
}

// Strand and entry of a piece: those of the nearer point.
fn hair_name(k: u32, joint: u32) -> vec2u {
    let mark = hair_marks[k + select(0u, 1u, 2u * joint >= hair_geometry.subdivisions && joint > 0u)];
    return vec2u(mark.x, mark.y & 0xffffu);
}

// Size of a pixel where the place is; in front of the near plane that of the near plane, so that what is clipped there
// stays finite.
fn hair_pixel(position: vec3f) -> f32 {
    return view_pixel(max(view_depth(position), view.near));
}

// Six vertices a piece: two triangles that face the viewer.
@vertex
fn hair_ribbon(@builtin(vertex_index) index: u32) -> HairVertex {
    let piece = index / 6u;
    let corner = index % 6u;
    // Corners in turn: (root, -), (root, +), (tip, -), (tip, -), (root, +), (tip, +).
    let end = (0x2cu >> corner) & 1u;
    let h = f32((0x32u >> corner) & 1u) * 2.0 - 1.0;

    let k = hair_order[piece / hair_geometry.subdivisions];
    let joint = piece % hair_geometry.subdivisions;
    let place = hair_place(k, joint + end);

    // Never narrower than a pixel: what is missing goes to alpha.
    let pixel = hair_pixel(place.position);
    let radius = place.radius * hair_geometry.width;
    let drawn = max(radius, 0.5 * pixel);

    // The path tracer's h is -N·normalize(tangent × to_eye), with N from the axis to the hit: it grows along
    // to_eye × tangent.
    var to_eye = -view.forward;
    if view.perspective == 1u {
        to_eye = hair_unit(view.eye - place.position, to_eye);
    }
    var side = cross(to_eye, place.tangent);
    if dot(side, side) < 1e-12 {
        // Seen from its end a fiber has no side; any will do.
        side = view.across;
    }
    side = hair_unit(side, vec3f(1.0, 0.0, 0.0));

    // At a bend the side lies across the mean of two directions, for both pieces alike, so that they meet. Across its
    // own direction a piece is narrower there, by the cosine between the two; alpha makes up for it. More than half is
    // missing only where a strand turns back, and nothing can be made up for where alpha is 1.
    let chord = hair_position(k, joint + 1u - end) - place.position;
    let across = cross(to_eye, chord);
    let across2 = dot(across, across);
    var width_share = 1.0;
    if across2 > 1e-12 * dot(chord, chord) {
        width_share = clamp(abs(dot(side, across)) * inverseSqrt(across2), 0.5, 1.0);
    }
    let alpha = hair_geometry.opacity * min(radius / (drawn * width_share), 1.0);

    var v: HairVertex;
    v.position = place.position + side * (h * drawn);
    v.clip = view.clip_from_world * vec4f(v.position, 1.0);
    v.tangent = hair_shading_tangent(k, place);
    // The fiber's own diameter: that strands are left out does not change what one looks like.
    v.across = vec4f(h, alpha, 2.0 * place.radius / pixel, place.u);
    v.name = hair_name(k, joint);
    return v;
}

// Two vertices a piece.
@vertex
fn hair_line(@builtin(vertex_index) index: u32) -> HairVertex {
    let piece = index / 2u;
    let end = index & 1u;
    let k = hair_order[piece / hair_geometry.subdivisions];
    let joint = piece % hair_geometry.subdivisions;
    let place = hair_place(k, joint + end);
    let other = hair_place(k, joint + 1u - end);

    var v: HairVertex;
    v.position = place.position;
    v.clip = view.clip_from_world * vec4f(v.position, 1.0);
    // Some devices draw lines as rectangles. With others a line has one pixel for each row or column that it crosses,
    // whichever are more: fewer than its length.
    var stretch = 1.0;
    let far_end = view.clip_from_world * vec4f(other.position, 1.0);
    if hair_geometry.slanted == 1u && v.clip.w > 0.0 && far_end.w > 0.0 {
        let span = abs((far_end.xy / far_end.w - v.clip.xy / v.clip.w) * view.size);
        let pixels = max(span.x, span.y);
        if pixels > 0.0 {
            stretch = clamp(length(span / pixels), 1.0, 1.41421356);
        }
    }
    let pixel = hair_pixel(place.position);
    let width = 2.0 * place.radius * hair_geometry.width / pixel;
    v.tangent = hair_shading_tangent(k, place);
    v.across = vec4f(2.0, hair_geometry.opacity * min(width * stretch, 1.0), 2.0 * place.radius / pixel, place.u);
    v.name = hair_name(k, joint);
    return v;
}

// As `math::hash::mix`.
fn hair_mix(word: u32) -> u32 {
    var x = word;
    x = (x ^ (x >> 16u)) * 0x7feb352du;
    x = (x ^ (x >> 15u)) * 0x846ca68bu;
    return x ^ (x >> 16u);
}

// What a pixel sees of a piece.
fn hair_fragment(v: HairVertex) -> Fragment {
    var f: Fragment;
    f.position = v.position;
    // The same expression in every pass: techniques find fragments of another pass again by their depth.
    f.depth = view_depth(v.position);
    f.tangent = hair_unit(v.tangent, vec3f(1.0, 0.0, 0.0));
    f.alpha = clamp(v.across.y, 0.0, 1.0);
    f.h = clamp(v.across.x, -1.0, 1.0);
    if v.across.x > 1.5 {
        // A pixel of a line sees the whole width: one place of it, drawn by lot, is right on average. The lot depends
        // on pixel and strand alone, so that every pass draws the same.
        let pixel = vec2u(v.clip.xy);
        let lot = hair_mix(hair_mix(hair_mix(pixel.x) + pixel.y) + v.name.x);
        f.h = (f32(lot >> 8u) + 0.5) / 8388608.0 - 1.0;
    }
    f.width_px = v.across.z;
    f.u = v.across.w;
    f.entry = v.name.y;
    f.strand = v.name.x;
    return f;
}
