// The modified Bessel function of order zero, scaled so that it cannot overflow. Twin of `lobe/bessel.rs`.

// `exp(-|x|) I0(x)`, relative error below 3e-7: polynomials 9.8.1 and 9.8.2 of Abramowitz & Stegun.
fn bessel_i0e(x: f32) -> f32 {
    let a = abs(x);
    if a < 3.75 {
        let y = (a / 3.75) * (a / 3.75);
        var p = 0.0045813;
        p = p * y + 0.0360768;
        p = p * y + 0.2659732;
        p = p * y + 1.2067492;
        p = p * y + 3.0899424;
        p = p * y + 3.5156229;
        p = p * y + 1.0;
        return exp(-a) * p;
    }
    let y = 3.75 / a;
    var p = 0.00392377;
    p = p * y - 0.01647633;
    p = p * y + 0.02635537;
    p = p * y - 0.02057706;
    p = p * y + 0.00916281;
    p = p * y - 0.00157565;
    p = p * y + 0.00225319;
    p = p * y + 0.01328592;
    p = p * y + 0.3989423;
    return p / sqrt(a);
}
