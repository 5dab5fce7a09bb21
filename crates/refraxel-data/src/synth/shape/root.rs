//! The end of every search for a crossing: a sign change in a bracket.

/// Bisection alone reaches the resolution of f64 from any bracket of a scene.
const ROUNDS: usize = 60;
/// Newton's steps shorter than this end the search [scene unit].
const STEP_END: f64 = 1e-15;

/// Value of a function along a ray, and its derivative by arc length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Along {
    pub value: f64,
    pub slope: f64,
}

/// Arc length of the sign change of `f` in a bracket: Newton's steps, replaced by bisection where they leave the bracket.
///
/// `is_outside_first` says whether `f` is positive at the start of the bracket. Error: that of `f` divided by its slope.
pub(super) fn sign_change(bracket: [f64; 2], is_outside_first: bool, f: impl Fn(f64) -> Along) -> f64 {
    let [mut a, mut b] = bracket;
    let mut s = 0.5 * (a + b);
    for _ in 0..ROUNDS {
        let at = f(s);
        if (at.value > 0.0) == is_outside_first {
            a = s;
        } else {
            b = s;
        }
        let newton = s - at.value / at.slope;
        if (newton - s).abs() < STEP_END {
            return s;
        }
        s = if newton > a && newton < b { newton } else { 0.5 * (a + b) };
    }
    s
}
