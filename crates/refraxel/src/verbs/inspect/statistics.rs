//! Medians, spreads, and which views show about the same.

use refraxel_data::View;

/// Views whose medians a view is compared with.
const NEIGHBOURS: usize = 8;
/// Fewer neighbours of the same size as a view are no sample.
const LEAST: usize = 4;

/// The value below which the share `q` of all finite ones lies; `None` where there are none.
pub fn quantile(values: impl IntoIterator<Item = f64>, q: f64) -> Option<f64> {
    refraxel_data::quantile(values.into_iter().filter(|v| v.is_finite()), q)
}

/// The value in the middle.
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    quantile(values, 0.5)
}

/// How far values lie around 0, whatever a few of them are: the standard deviation where they are normally distributed.
pub fn spread(values: impl IntoIterator<Item = f64>) -> f64 {
    1.4826 * median(values.into_iter().map(f64::abs)).unwrap_or(0.0)
}

/// Of each view those of `all` that stand and look most alike, of the same image size where there are enough of these.
///
/// `distance` [scene unit] counts as much as a radian.
pub fn neighbours(views: &[View], all: &[usize], distance: f64) -> Vec<Vec<usize>> {
    let apart = |a: usize, b: usize| {
        let [a, b] = [a, b].map(|i| &views[i].camera);
        let away = (a.world_from_camera.translation - b.world_from_camera.translation).length();
        away / distance.max(f64::MIN_POSITIVE) + a.forward().dot(b.forward()).clamp(-1.0, 1.0).acos()
    };
    let size = |i: usize| {
        let c = &views[i].camera;
        [c.width.min(c.height), c.width.max(c.height)]
    };
    let near = |&view: &usize| {
        let mut others: Vec<(f64, usize)> =
            all.iter().filter(|&&i| i != view).map(|&i| (apart(view, i), i)).collect();
        others.sort_by(|a, b| a.0.total_cmp(&b.0));
        let of_size: Vec<usize> =
            others.iter().map(|o| o.1).filter(|&i| size(i) == size(view)).take(NEIGHBOURS).collect();
        if of_size.len() >= LEAST { of_size } else { others.iter().map(|o| o.1).take(NEIGHBOURS).collect() }
    };
    all.iter().map(near).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{Camera, Vec3, vec3};

    #[test]
    fn medians_and_spreads_ignore_a_few_wild_values() {
        assert_eq!(median([3.0, 1.0, 1e9]), Some(3.0));
        assert_eq!((median([]), quantile([1.0, 2.0, 3.0, 4.0, 5.0], 0.75)), (None, Some(4.0)));
        assert!((spread([-1.0, 1.0, 1.0, -1.0, 500.0]) - 1.4826).abs() < 1e-12);
    }

    #[test]
    fn neighbours_stand_near_and_have_the_same_size() {
        let view = |k: usize| {
            let angle = k as f64 / 40.0 * std::f64::consts::TAU;
            let eye = vec3(3.0 * angle.cos(), 3.0 * angle.sin(), 1.0);
            let size = if k.is_multiple_of(2) { [8, 6] } else { [12, 6] };
            let camera = Camera::look_at(eye, Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.8, size);
            View::of_file(format!("{k}.png"), camera)
        };
        let views: Vec<View> = (0..40).map(view).collect();
        let mut found = neighbours(&views, &(0..40).collect::<Vec<_>>(), 3.0).swap_remove(20);
        found.sort_unstable();
        assert_eq!(found, [12, 14, 16, 18, 22, 24, 26, 28]);
    }
}
