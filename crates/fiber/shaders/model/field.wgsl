// Near field or far field. Twin of `model/field.rs`.

const FIELD_NEAR: u32 = 0u;  // the offset of the hit matters
const FIELD_FAR: u32 = 1u;   // the cross-section is integrated out
const FIELD_AUTO: u32 = 2u;  // by how wide the fiber looks

// Wider than any fiber: where the width in pixels has no meaning.
const FIELD_ANY_WIDTH: f32 = 1e30;

// Share of the near field for a fiber that looks `width_px` pixels wide.
fn field_near_share(field: u32, width_px: f32) -> f32 {
    if field == FIELD_NEAR {
        return 1.0;
    }
    if field == FIELD_FAR {
        return 0.0;
    }
    return clamp((width_px - 0.75) / 0.75, 0.0, 1.0);
}

// A mixture of the two; a term without a share may hold anything finite.
fn field_blend(near_share: f32, near: Lobes, far: Lobes) -> Lobes {
    let far_share = 1.0 - near_share;
    return Lobes(
        near.r * near_share + far.r * far_share,
        near.tt * near_share + far.tt * far_share,
        near.trt * near_share + far.trt * far_share,
        near.residual * near_share + far.residual * far_share,
    );
}
