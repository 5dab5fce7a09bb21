//! The mixture of mirrored and transmitted light in one pixel, theory (7.5): sRGB codes are added as light.
//!
//! The field holds sRGB codes, and emission and absorption mix codes: its opacities are learned from such mixtures. The share
//! that a surface mirrors is not learned but follows from the index, and it is a share of light.
//!
//! Source of the curve: IEC 61966-2-1.

use crate::Real;

/// Codes below this are proportional to light [1, a code].
pub const TOE: f64 = 0.04045;
/// Slope of code by light below [`TOE`] [1].
pub const TOE_SLOPE: f64 = 12.92;
/// a of the curve code = (1 + a) light^(1/γ) − a above the toe [1].
pub const OFFSET: f64 = 0.055;
/// γ of that curve [1].
pub const GAMMA: f64 = 2.4;

/// Light ℓ of an sRGB code ≥ 0 (1 = white for both), and its slope. Codes above 1 continue the curve. Not differentiable at
/// the end of the toe, where the slope jumps by 1.7 %.
fn light<T: Real>(code: T) -> (T, T) {
    if code <= T::of(TOE) {
        let slope = T::of(TOE_SLOPE.recip());
        return (code * slope, slope);
    }
    let base = (code + T::of(OFFSET)) * T::of((1.0 + OFFSET).recip());
    let power = base.powf(T::of(GAMMA - 1.0));
    (power * base, power * T::of(GAMMA / (1.0 + OFFSET)))
}

/// sRGB code ℓ⁻¹ of light ≥ 0, and its slope.
fn code<T: Real>(light: T) -> (T, T) {
    if light <= T::of(TOE / TOE_SLOPE) {
        return (light * T::of(TOE_SLOPE), T::of(TOE_SLOPE));
    }
    let power = light.powf(T::of(GAMMA.recip()));
    let slope = power / light * T::of((1.0 + OFFSET) / GAMMA);
    (power * T::of(1.0 + OFFSET) - T::of(OFFSET), slope)
}

/// The colour of a surface that mirrors `share` of the light `mirrored` and passes the rest of `behind`, theory (7.5). The
/// colours are codes ≥ 0, the share is in [0, 1]. Between equal lights the surface is invisible, whatever the share.
///
/// Worked number: 4 % of white before black shows as 0.2209, not as 0.04.
#[inline]
pub fn mix<T: Real>(share: T, mirrored: [T; 3], behind: [T; 3]) -> [T; 3] {
    std::array::from_fn(|c| {
        let (r, t) = (light(mirrored[c]).0, light(behind[c]).0);
        code(t + (r - t) * share).0
    })
}

/// The light by which `shown` exceeds `rest`, as codes: a mixture without one of its parts.
pub fn without<T: Real>(shown: [T; 3], rest: [T; 3]) -> [T; 3] {
    std::array::from_fn(|c| code((light(shown[c]).0 - light(rest[c]).0).max(T::zero())).0)
}

/// dLoss/d(arguments of [`mix`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MixAdjoint<T> {
    /// dLoss/dshare.
    pub share: T,
    /// dLoss/dmirrored.
    pub mirrored: [T; 3],
    /// dLoss/dbehind.
    pub behind: [T; 3],
}

/// Transpose of the derivative of [`mix`], theory (7.6), given dLoss/d(colour shown).
#[inline]
pub fn mix_vjp<T: Real>(share: T, mirrored: [T; 3], behind: [T; 3], d_shown: [T; 3]) -> MixAdjoint<T> {
    let mut d = MixAdjoint { share: T::zero(), mirrored: [T::zero(); 3], behind: [T::zero(); 3] };
    for c in 0..3 {
        let ((r, r_slope), (t, t_slope)) = (light(mirrored[c]), light(behind[c]));
        let d_light = d_shown[c] * code(t + (r - t) * share).1;
        d.share += d_light * (r - t);
        d.mirrored[c] = d_light * share * r_slope;
        d.behind[c] = d_light * (T::one() - share) * t_slope;
    }
    d
}

/// What absorbs a part of the light of each channel: it multiplies light by e^(−thickness), theory (7.17), and codes
/// accordingly, theory (7.18).
///
/// Both a colour and what it becomes are above the toe of the curve but for dark colours. There the code plus 0.055 is
/// multiplied by e^(−thickness/γ): a mixture of codes passes as its parts do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filter<T> {
    /// Optical thickness per channel [1], >= 0.
    thickness: [T; 3],
    /// e^(−thickness/γ).
    factor: [T; 3],
}

/// A colour behind a [`Filter`], and its derivatives per channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filtered<T> {
    /// What is seen [1, a code].
    pub colour: [T; 3],
    /// dcolour/d(colour before) [1], theory (7.19).
    pub slope: [T; 3],
    /// dcolour/dthickness [1, a code], <= 0, theory (7.19).
    pub by_thickness: [T; 3],
}

/// dLoss/d(arguments of [`Filter::through`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterAdjoint<T> {
    /// dLoss/d(colour before).
    pub colour: [T; 3],
    /// dLoss/dthickness.
    pub thickness: [T; 3],
}

impl<T: Real> Filter<T> {
    /// A filter of this optical thickness per channel [1].
    #[inline]
    pub fn new(thickness: [T; 3]) -> Self {
        Self { thickness, factor: thickness.map(|u| (u * T::of(-GAMMA.recip())).exp()) }
    }

    /// No filter.
    #[must_use]
    pub fn clear() -> Self {
        Self { thickness: [T::zero(); 3], factor: [T::one(); 3] }
    }

    /// Its optical thickness per channel [1].
    pub fn thickness(&self) -> [T; 3] {
        self.thickness
    }

    /// The colour `code` >= 0 seen through the filter, theory (7.18); the same bits where the thickness is 0.
    ///
    /// Worked number: white behind a thickness of ln 2 shows as 0.7354, not as 0.5.
    /// Not differentiable at the end of the toe; see [`mix`].
    #[inline]
    pub fn through(&self, code: [T; 3]) -> Filtered<T> {
        let zero = [T::zero(); 3];
        let mut out = Filtered { colour: zero, slope: zero, by_thickness: zero };
        for c in 0..3 {
            [out.colour[c], out.slope[c], out.by_thickness[c]] = self.channel(c, code[c]);
        }
        out
    }

    /// Colour, slope and derivative by thickness of one channel.
    #[inline(always)]
    fn channel(&self, c: usize, before: T) -> [T; 3] {
        let (u, k) = (self.thickness[c], self.factor[c]);
        if u == T::zero() {
            return [before, T::one(), by_first_thickness(before)];
        }
        let above = (before + T::of(OFFSET)) * k;
        let after = above - T::of(OFFSET);
        if before > T::of(TOE) && after > T::of(TOE) {
            return [after, k, above * T::of(-GAMMA.recip())];
        }
        let ((light, slope), transmittance) = (light(before), (-u).exp());
        let (after, code_slope) = code(light * transmittance);
        [after, code_slope * transmittance * slope, -code_slope * transmittance * light]
    }
}

impl<T: Real> Filtered<T> {
    /// A colour that nothing filters, and whose derivative by thickness is not asked for.
    pub fn unfiltered(colour: [T; 3]) -> Self {
        Self { colour, slope: [T::one(); 3], by_thickness: [T::zero(); 3] }
    }

    /// Transpose of the derivative of [`Filter::through`], theory (7.19), given dLoss/d(colour seen).
    #[inline]
    pub fn vjp(&self, d_colour: [T; 3]) -> FilterAdjoint<T> {
        let times = |by: [T; 3]| std::array::from_fn(|c| d_colour[c] * by[c]);
        FilterAdjoint { colour: times(self.slope), thickness: times(self.by_thickness) }
    }
}

/// dcolour/dthickness of a colour behind a filter of thickness 0, theory (7.19): −ℓ/ℓ'.
#[inline(always)]
fn by_first_thickness<T: Real>(code: T) -> T {
    if code > T::of(TOE) { (code + T::of(OFFSET)) * T::of(-GAMMA.recip()) } else { -code }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_and_light_are_inverse_and_slopes_are_derivatives() {
        let e = 1e-6;
        for c in [0.0_f64, 0.01, 0.03, 0.05, 0.3, 0.9, 1.4] {
            let (l, slope) = light(c);
            assert!((code(l).0 - c).abs() < 1e-7 && (code(l).1 * slope - 1.0).abs() < 1e-6);
            let fd = (light(c + e).0 - light(c - e).0) / (2.0 * e);
            assert!((fd - slope).abs() < 1e-6);
        }
        assert!((light(0.5_f64).0 - 0.214_041).abs() < 1e-6 && (light(1.0_f64).0 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn mixing_keeps_the_energy() {
        let (r, t) = ([0.9_f64, 0.2, 0.5], [0.1, 0.7, 0.5]);
        for share in [0.0_f64, 0.04, 0.5, 1.0] {
            let shown = mix(share, r, t);
            for c in 0..3 {
                let energy = share * light(r[c]).0 + (1.0 - share) * light(t[c]).0;
                assert!((light(shown[c]).0 - energy).abs() < 1e-7);
            }
            assert!((mix(share, t, t)[1] - 0.7).abs() < 1e-7, "a furnace stays one colour");
        }
        let rest = mix(0.3, [0.0; 3], t);
        assert!((without(mix(0.3, r, t), rest)[0] - mix(0.3, r, [0.0; 3])[0]).abs() < 1e-7);
        assert!((mix(0.04, [1.0; 3], [0.0; 3])[0] - 0.2209_f64).abs() < 1e-4);
    }

    #[test]
    fn a_filter_multiplies_light() {
        let code_before = [0.02_f64, 0.06, 0.9];
        for thickness in [0.0, 0.3, 1.0, 4.0] {
            let seen = Filter::new([thickness; 3]).through(code_before).colour;
            for c in 0..3 {
                let expected = light(code_before[c]).0 * (-thickness).exp();
                assert!((light(seen[c]).0 - expected).abs() < 1e-7, "{thickness}: {}", seen[c]);
            }
        }
        assert_eq!(Filter::clear().through(code_before).colour, code_before);
        let half = Filter::new([2.0_f64.ln(); 3]).through([1.0; 3]).colour[0];
        assert!((half - 0.7354).abs() < 1e-4, "{half}");
    }

    #[test]
    fn filters_one_behind_the_other_are_one_and_pass_mixtures_as_their_parts() {
        let (u, v, code) = ([0.2, 0.9, 1.5], [0.1, 0.0, 0.7], [0.8_f64, 0.5, 0.95]);
        let both = Filter::new([0, 1, 2].map(|c: usize| u[c] + v[c])).through(code).colour;
        let after = Filter::new(u).through(Filter::new(v).through(code).colour).colour;
        assert!((0..3).all(|c| (both[c] - after[c]).abs() < 1e-9));
        let (one, other) = ([0.7, 0.9, 0.5], [0.4, 0.3, 0.9]);
        let mixed = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].map(|c: usize| 0.3 * a[c] + 0.7 * b[c]);
        let of = |code| Filter::new(v).through(code).colour;
        let (whole, parts) = (of(mixed(one, other)), mixed(of(one), of(other)));
        assert!((0..3).all(|c| (whole[c] - parts[c]).abs() < 1e-12));
    }

    #[test]
    fn derivatives_of_a_filter_match_central_differences() {
        let e = 1e-6;
        for (u, code) in [(0.0, 0.5), (0.7, 0.9), (3.0, 0.2), (0.4, 0.02), (0.4, 0.0)] {
            let of = |u: f64, code: f64| Filter::new([u; 3]).through([code; 3]);
            let d = of(u, code);
            let slope = (of(u, code + e).colour[0] - of(u, code - e).colour[0]) / (2.0 * e);
            let by_thickness = (of(u + e, code).colour[0] - of(u - e, code).colour[0]) / (2.0 * e);
            assert!((d.slope[0] - slope).abs() < 1e-7, "{u} {code}: {} {slope}", d.slope[0]);
            assert!((d.by_thickness[0] - by_thickness).abs() < 1e-7, "{u} {code}: {by_thickness}");
            let d_seen = d.vjp([0.4, 0.0, 0.0]);
            assert!((d_seen.colour[0] - 0.4 * slope).abs() < 1e-7, "{u} {code}: {d_seen:?}");
            assert!((d_seen.thickness[0] - 0.4 * by_thickness).abs() < 1e-7, "{u} {code}: {d_seen:?}");
        }
    }

    #[test]
    fn derivatives_match_central_differences() {
        let (share, r, t, g) = (0.3, [0.9, 0.02, 0.5], [0.1, 0.7, 0.01], [0.7, -0.4, 1.1]);
        let f = |v: [f64; 7]| {
            let shown = mix(v[0], [v[1], v[2], v[3]], [v[4], v[5], v[6]]);
            (0..3).map(|c| g[c] * shown[c]).sum::<f64>()
        };
        let at = [share, r[0], r[1], r[2], t[0], t[1], t[2]];
        let d = mix_vjp(share, r, t, g);
        let exact =
            [d.share, d.mirrored[0], d.mirrored[1], d.mirrored[2], d.behind[0], d.behind[1], d.behind[2]];
        for i in 0..7 {
            let along = |e: f64| {
                let mut v = at;
                v[i] += e;
                f(v)
            };
            let fd = (along(1e-6) - along(-1e-6)) / 2e-6;
            assert!((fd - exact[i]).abs() < 1e-7, "{i}: {fd} vs {}", exact[i]);
        }
    }
}
