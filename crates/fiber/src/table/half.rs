//! Numbers of 16 bits (IEEE 754 binary16), for textures.

/// The largest finite number: `(2 - 2⁻¹⁰) 2¹⁵`.
const MOST: f32 = 65504.0;

/// The smallest number with all its digits: `2⁻¹⁴`.
const LEAST_NORMAL: f32 = 1.0 / 16384.0;

/// The nearest half-precision number, as its bits; ties go to the even one.
///
/// What is beyond all of them, infinity included, becomes the largest finite one (65504): an infinite texel would
/// spoil all that is filtered with it.
#[inline]
pub fn to_half(x: f32) -> u16 {
    let sign = ((x.to_bits() >> 16) & 0x8000) as u16;
    let size = x.abs();
    if size.is_nan() {
        return sign | 0x7e00;
    }
    if size >= MOST {
        return sign | 0x7bff;
    }
    let bits = if size < LEAST_NORMAL {
        // Here halves are 2⁻²⁴ apart, and so are the single-precision numbers from ½ on: the sum is rounded as
        // wished, and what it has gained over ½ counts the steps.
        (size + 0.5).to_bits() - 0.5_f32.to_bits()
    } else {
        // 13 digits go, rounded into the one in front, and the exponent counts from -15, not -127.
        let bits = size.to_bits();
        let odd = (bits >> 13) & 1;
        ((bits + 0xfff + odd) >> 13) - (112 << 10)
    };
    // At most 0x7bff.
    sign | bits as u16
}

/// The number that these bits are in half precision.
#[inline]
pub fn from_half(bits: u16) -> f32 {
    let sign = u32::from(bits & 0x8000) << 16;
    let rest = u32::from(bits & 0x7fff);
    let size = match rest >> 10 {
        0 => rest as f32 * (1.0 / 16_777_216.0),
        31 if rest == 0x7c00 => f32::INFINITY,
        31 => f32::NAN,
        _ => f32::from_bits((rest << 13) + (112 << 23)),
    };
    f32::from_bits(size.to_bits() | sign)
}
