//! Slices through the middle of each refractive region, beside the truth where it is known.

use crate::colour_map::ColourMap;
use crate::picture::{ColourScale, Content, Map, Panel, Row, Sheet};
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
pub fn sheet(refraction: &Refraction, truth: Option<&IndexTruth>, origin: LocalOrigin) -> Sheet<'static> {
    let slices = |bounds: &Aabb<f64>, value: &(dyn Fn(Vec3<f64>) -> f32 + Sync)| -> Vec<Panel<'static>> {
        SLICES.iter().map(|slice| slice.panel(bounds, origin, value)).collect()
    };
    let found = |x: Vec3<f64>| refraction.index(x.cast());
    let known = |t: &IndexTruth, x: Vec3<f64>| if t.is_opaque(x) { f32::NAN } else { t.n(x) as f32 };
    let mut rows = Vec::new();
    for (k, region) in refraction.medium.regions().iter().enumerate() {
        let bounds = region.domain().bounds.cast();
        let name = format!("region {}", k + 1);
        let row = |what: &str, panels| Row { caption: format!("{name}: {what}"), panels, scale: None };
        rows.push((ColourMap::Viridis, row("index of refraction", slices(&bounds, &found))));
        if let Some(truth) = truth {
            rows.push((ColourMap::Viridis, row("truth", slices(&bounds, &|x| known(truth, x)))));
            let error = slices(&bounds, &|x| found(x) - known(truth, x));
            rows.push((ColourMap::Signed, row("index minus truth", error)));
        }
    }
    let title = "Index of refraction through the middle of each region".to_owned();
    Sheet { title, columns: Vec::new(), rows: coloured(rows, index_range(refraction)) }
}

/// One range for all indices; errors are white at 0 and saturate at half the contrast.
fn coloured(rows: Vec<(ColourMap, Row<'static>)>, range: [f32; 2]) -> Vec<Row<'static>> {
    let indices = rows.iter().filter(|(map, _)| *map == ColourMap::Viridis).flat_map(|(_, row)| &row.panels);
    let values = indices.flat_map(|panel| panel.content.values()).filter(|v| !v.is_nan());
    let [low, high] = values.fold(range, |[a, b], &v| [a.min(v), b.max(v)]);
    let most = (0.5 * (high - low)).max(1e-3);
    let scale = |map: ColourMap| {
        let range = if map == ColourMap::Viridis { [low, high.max(low + 1e-3)] } else { [-most, most] };
        Some(ColourScale::Values(map, range))
    };
    rows.into_iter().map(|(map, row)| Row { scale: scale(map), ..row }).collect()
}

impl Slice {
    fn panel(
        self,
        bounds: &Aabb<f64>,
        origin: LocalOrigin,
        value: &(dyn Fn(Vec3<f64>) -> f32 + Sync),
    ) -> Panel<'static> {
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
        let map = Map {
            size: [width, height],
            values: (0..width * height).into_par_iter().map(at).collect(),
            unit: Some(unit),
            lines: Vec::new(),
        };
        let note = format!(
            "{} = {:.d$}; right: {}, up: {}",
            AXES[across],
            origin.to_world(middle)[across],
            AXES[right],
            AXES[up],
            d = decimals(extent.max_element(), 3)
        );
        Panel { content: Content::Map(map), note }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{IndexGrid, LevelSet, vec3};
    use serde_json::json;

    #[test]
    fn slices_of_the_truth_have_no_error_and_the_right_way_up() {
        let middle = vec3(0.1_f32, -0.2, 0.3);
        let bounds = Aabb::cube_at(middle, 0.5);
        let ball = vec3(0.1_f32, -0.2, 0.4); // above the middle of the box
        let surface = LevelSet::from_samples(bounds, [41; 3], |x: Vec3<f32>| (x - ball).length() - 0.25);
        let refraction = Refraction::of(vec![IndexGrid::sharp(surface, 1.5)]);
        let entry = json!({ "shape": "sphere", "center": ball.to_array(), "radius": 0.25, "ior": 1.5 });
        let truth = IndexTruth::from_scene_json(&json!({ "refractive": [entry] })).unwrap();
        let sheet = sheet(&refraction, Some(&truth), LocalOrigin::default());
        assert_eq!(sheet.rows.len(), 3);
        for panel in &sheet.rows[2].panels {
            let values = panel.content.values();
            let wrong = values.iter().filter(|v| v.abs() > 1e-4).count();
            assert!(wrong * 200 < values.len(), "{wrong} pixels of {}", panel.note);
        }
        for panel in &sheet.rows[0].panels[..2] {
            let (upper, lower) = panel.content.values().split_at(panel.content.values().len() / 2);
            let inside = |v: &[f32]| v.iter().filter(|&&n| n > 1.2).count();
            assert!(inside(upper) > 2 * inside(lower), "{}", panel.note);
        }
        let range = |row: usize| match sheet.rows[row].scale {
            Some(ColourScale::Values(_, range)) => range,
            other => panic!("{other:?}"),
        };
        let [[low, high], [_, most]] = [range(0), range(2)];
        assert!(low == 1.0 && (high - 1.5).abs() < 1e-5 && (most - 0.25).abs() < 1e-5);
    }
}
