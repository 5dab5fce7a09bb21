//! Slices through the middle of each refractive region, beside the truth where it is known.

use crate::colour_map::ColourMap;
use crate::maps::{Map, Row, Sheet};
use crate::table::decimals;
use rayon::prelude::*;
use refraxel_core::{Aabb, Vec3};
use refraxel_data::LocalOrigin;
use refraxel_data::synth::IndexTruth;
use refraxel_train::Refraction;
use refraxel_train::model::index_edit::index_range;

/// Pixels along the longest edge of a region.
const PIXELS: f64 = 260.0;
/// Names of the axes.
const AXES: [&str; 3] = ["x", "y", "z"];
/// One slice across each axis.
const SLICES: [Slice; 3] = [
    Slice { across: 0, right: 1, up: 2 },
    Slice { across: 1, right: 0, up: 2 },
    Slice { across: 2, right: 0, up: 1 },
];

/// A plane through the middle of a region: the axis that it cuts, and those that run right and up in the picture.
#[derive(Clone, Copy)]
struct Slice {
    across: usize,
    right: usize,
    up: usize,
}

/// A page with the index n of each region in a row; with the truth, two more rows show the truth and n minus the truth. Coordinates
/// have this origin.
pub fn sheet(refraction: &Refraction, truth: Option<&IndexTruth>, origin: LocalOrigin) -> Sheet {
    let maps = |bounds: &Aabb<f64>, value: &(dyn Fn(Vec3<f64>) -> f32 + Sync)| -> Vec<Map> {
        SLICES.iter().map(|slice| slice.map(bounds, origin, value)).collect()
    };
    let found = |x: Vec3<f64>| refraction.index(x.cast());
    let known = |t: &IndexTruth, x: Vec3<f64>| if t.is_opaque(x) { f32::NAN } else { t.n(x) as f32 };
    let mut rows = Vec::new();
    for (k, region) in refraction.medium.regions().iter().enumerate() {
        let bounds = region.domain().bounds.cast();
        let name = format!("region {}", k + 1);
        let row = |what: &str, maps| Row {
            caption: format!("{name}: {what}"),
            maps,
            colours: ColourMap::Viridis,
            range: [1.0, 1.0],
        };
        rows.push(row("index of refraction", maps(&bounds, &found)));
        if let Some(truth) = truth {
            rows.push(row("truth", maps(&bounds, &|x| known(truth, x))));
            let error = maps(&bounds, &|x| found(x) - known(truth, x));
            rows.push(Row { colours: ColourMap::Signed, ..row("index minus truth", error) });
        }
    }
    colour(&mut rows, index_range(refraction));
    Sheet { title: "Index of refraction through the middle of each region".to_owned(), rows }
}

/// One range for all indices; errors are white at 0 and saturate at half the contrast.
fn colour(rows: &mut [Row], range: [f32; 2]) {
    let is_index = |r: &&Row| r.colours == ColourMap::Viridis;
    let values = rows.iter().filter(is_index).flat_map(|r| &r.maps).flat_map(|m| &m.values);
    let [low, high] = values.filter(|v| !v.is_nan()).fold(range, |[a, b], &v| [a.min(v), b.max(v)]);
    let most = (0.5 * (high - low)).max(1e-3);
    for row in rows {
        row.range =
            if row.colours == ColourMap::Viridis { [low, high.max(low + 1e-3)] } else { [-most, most] };
    }
}

impl Slice {
    fn map(self, bounds: &Aabb<f64>, origin: LocalOrigin, value: &(dyn Fn(Vec3<f64>) -> f32 + Sync)) -> Map {
        let Self { across, right, up } = self;
        let (middle, extent) = (bounds.center(), bounds.extent());
        let unit = extent.max_element() / PIXELS;
        let [width, height] = [right, up].map(|a| (extent[a] / unit).round().max(1.0) as usize);
        let at = |i: usize| {
            let mut x = middle;
            x[right] = bounds.min[right] + (0.5 + (i % width) as f64) * extent[right] / width as f64;
            x[up] = bounds.max[up] - (0.5 + (i / width) as f64) * extent[up] / height as f64;
            value(x)
        };
        Map {
            size: [width, height],
            values: (0..width * height).into_par_iter().map(at).collect(),
            note: format!(
                "{} = {:.d$}; right: {}, up: {}",
                AXES[across],
                origin.to_world(middle)[across],
                AXES[right],
                AXES[up],
                d = decimals(extent.max_element(), 3)
            ),
            unit: Some(unit),
            lines: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{IndexGrid, LevelSet, Medium, vec3};
    use serde_json::json;

    #[test]
    fn slices_of_the_truth_have_no_error_and_the_right_way_up() {
        let middle = vec3(0.1_f32, -0.2, 0.3);
        let bounds = Aabb::new(middle - Vec3::splat(0.5), middle + Vec3::splat(0.5));
        let ball = vec3(0.1_f32, -0.2, 0.4); // above the middle of the box
        let surface = LevelSet::from_samples(bounds, [41; 3], |x: Vec3<f32>| (x - ball).length() - 0.25);
        let mut refraction = Refraction::none();
        refraction.medium = Medium::new(vec![IndexGrid::sharp(surface, 1.5)]).unwrap();
        refraction.states = vec![Default::default()];
        let entry = json!({ "shape": "sphere", "center": ball.to_array(), "radius": 0.25, "ior": 1.5 });
        let truth = IndexTruth::from_scene_json(&json!({ "refractive": [entry] })).unwrap();
        let sheet = sheet(&refraction, Some(&truth), LocalOrigin::default());
        assert_eq!(sheet.rows.len(), 3);
        for map in &sheet.rows[2].maps {
            let wrong = map.values.iter().filter(|v| v.abs() > 1e-4).count();
            assert!(wrong * 200 < map.values.len(), "{wrong} pixels of {}", map.note);
        }
        for map in &sheet.rows[0].maps[..2] {
            let half = map.values.len() / 2;
            let inside = |v: &[f32]| v.iter().filter(|&&n| n > 1.2).count();
            assert!(inside(&map.values[..half]) > 2 * inside(&map.values[half..]), "{}", map.note);
        }
        let [[low, high], [_, most]] = [sheet.rows[0].range, sheet.rows[2].range];
        assert!(low == 1.0 && (high - 1.5).abs() < 1e-5 && (most - 0.25).abs() < 1e-5);
    }
}
