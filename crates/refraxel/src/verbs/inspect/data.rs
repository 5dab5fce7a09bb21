//! Describes a dataset, and the memory that training on it would take.

use super::pictures::{self, Pictures};
use super::views::{ViewReport, Views};
use crate::cli::{ForecastArgs, InspectArgs, Refraction};
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::Show;
use crate::table::{bytes, count, decimals};
use crate::verbs::dataset::{data_failure, load_photos, open_options, reduce_or_fit};
use crate::verbs::{known_index, options};
use refraxel_data::{Dataset, Inspection, Reduction, Region, View, report, scene_region};
use refraxel_train::Options;
use refraxel_train::memory::{Forecast, forecast};
use refraxel_train::options::Switch;
use refraxel_train::plan::{Plan, finest_domain};
use refraxel_train::refraction_search;
use serde::Serialize;

/// Photographs that are decoded to find the box; training uses as many.
const DECODED: usize = 32;
/// How many of their pixels are looked at: cells of the box are far larger.
const LOOKED_AT: Reduction = Reduction::Longest(1024);

#[derive(Serialize)]
struct Report {
    kind: &'static str,
    #[serde(flatten)]
    inspection: Inspection,
    /// The box around the content of the photographs, which training fills with voxels.
    content_box: [[f64; 3]; 2],
    /// With the options given, and the defaults of all others.
    forecast: Forecast,
    /// How many photographs were decoded and measured.
    looked_at: usize,
    /// All views in the order of the dataset.
    photographs: Vec<ViewReport>,
    /// Files, where they were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pictures: Option<Pictures>,
}

pub fn inspect(args: &InspectArgs) -> Result<(), Failure> {
    let show = Show::suited(args.json);
    let mut data = Dataset::open(args.path(), &open_options(&args.reading)).map_err(data_failure)?;
    reduce_or_fit(&mut data, args.training.downscale.map(u32::from), args.path(), Show::Nothing)?;
    let (region, surface) = content(&data, show)?;
    let options = options_of(&args.training, &data, &region)?;
    let views: Vec<&View> = data.split.train.iter().map(|&i| &data.views[i]).collect();
    let finest = finest_domain(&options, &region, &views, || surface);
    Plan::of_region(&options, &data, &region).check().or_exit(Exit::BadInput)?;
    let looked = Views::look_at(&data, &region, args.out.is_some(), show)?;
    let mut inspection = report(&data);
    inspection.problems.extend(looked.told());
    let report = Report {
        kind: "dataset",
        inspection,
        content_box: data.origin.to_world(region.bounds).to_arrays(),
        forecast: forecast(&options, &finest, &data, surface),
        looked_at: looked.looks.len(),
        photographs: looked.report(),
        pictures: args.out.as_deref().map(|out| pictures::write(&data, &region, &looked, out)).transpose()?,
    };
    Console::new(args.json).result(&report.text(), &report).or_exit(Exit::Io)
}

/// The options with which training would begin.
fn options_of(args: &ForecastArgs, data: &Dataset, region: &Region) -> Result<Options, Failure> {
    let is_told = refraction_search::is_told(args.index_from.is_some(), data);
    let mut usual = Options::suited_to(region.extent(), is_told && args.refraction != Refraction::Off);
    usual.refraction.bend = if is_told { Switch::On } else { Switch::Off };
    if let Some(file) = &args.index_from {
        known_index::suit(&mut usual, file);
        known_index::held(&mut usual);
    }
    let mut options = options::changed(usual, args.config.as_deref(), &args.settings)?;
    options::bend(args.refraction, &mut options);
    options.checked().or_exit(Exit::Usage)
}

/// The region that training would choose, and how much surface it holds.
fn content(data: &Dataset, show: Show) -> Result<(Region, Option<f64>), Failure> {
    let region = scene_region(data);
    if region.unbounded {
        return Ok((region, None));
    }
    let train = &data.split.train;
    let some: Vec<usize> = train.iter().copied().step_by(train.len().div_ceil(DECODED).max(1)).collect();
    let mut small = data.clone();
    small.reduce(&some, LOOKED_AT);
    let photos = load_photos(&small, &some, show)?;
    let region = region.around_content(&small, &some, &photos);
    Ok((region, region.surface_density(&small, &some, &photos)))
}

impl Report {
    fn text(&self) -> String {
        let i = &self.inspection;
        let mut lines = vec![
            format!("{}: {}", i.root.as_deref().unwrap_or("in memory"), i.format),
            format!(
                "views      {}: {} training, {} validation, {} test ({})",
                i.views.total, i.views.train, i.views.val, i.views.test, i.split_rule
            ),
            format!("images     {}; {} pixels", sizes(i), count(i.pixels)),
            format!("cameras    {}", cameras(i)),
            format!("backdrop   {}", i.backdrop),
            format!("masks      {}", masks(i)),
            format!(
                "box        {}{}",
                box_text(&self.content_box),
                if i.unbounded { ", and the photographs show more beyond it" } else { "" }
            ),
            format!("points     {}", count(i.points as u64)),
        ];
        if i.known_refractive_objects > 0 {
            lines.push(format!("truth      known refractive objects: {}", i.known_refractive_objects));
        }
        lines.push(self.forecast_text());
        lines.push(self.looked_text());
        for problem in &i.problems {
            lines.push(format!("{:<9}  {}", problem.severity, problem.message));
        }
        lines.join("\n")
    }

    fn looked_text(&self) -> String {
        let (some, all) = (self.looked_at, self.inspection.views.total);
        let which = if some < all { ", evenly chosen" } else { "" };
        match &self.pictures {
            None => format!(
                "looked at  {some} of {all} photographs{which}; --out DIR looks at all and draws them"
            ),
            Some(p) => {
                let [a, b, c] = [&p.photographs, &p.cameras, &p.views].map(|path| path.display());
                format!(
                    "looked at  {some} of {all} photographs\npictures   {a}\n           {b}\n           {c}"
                )
            }
        }
    }

    fn forecast_text(&self) -> String {
        let f = &self.forecast;
        let [x, y, z] = f.resolution;
        let silhouettes = if f.silhouettes > 0 {
            format!(", and {} hold silhouettes during the search for refractive things", bytes(f.silhouettes))
        } else {
            String::new()
        };
        format!(
            "training   {} grid {x}×{y}×{z}, about {} stored voxels of {} bytes: {}; in all up to about {}, of which {} are photographs{silhouettes}",
            f.extent,
            count(f.voxels),
            f.bytes_per_voxel,
            bytes(f.model),
            bytes(f.peak),
            bytes(f.photos),
        )
    }
}

fn sizes(i: &Inspection) -> String {
    let sizes: Vec<String> =
        i.image_sizes.iter().take(3).map(|s| format!("{} of {}×{}", s.count, s.width, s.height)).collect();
    let more = i.image_sizes.len().saturating_sub(3);
    if more > 0 { format!("{}, {more} more sizes", sizes.join(", ")) } else { sizes.join(", ") }
}

fn cameras(i: &Inspection) -> String {
    let c = &i.cameras;
    let range = |[low, high]: [f64; 2], unit: &str| {
        if high - low < 0.05 { format!("{low:.1} {unit}") } else { format!("{low:.1} to {high:.1} {unit}") }
    };
    let view = c.field_of_view.map_or(String::new(), |f| format!(", field of view {}", range(f, "degrees")));
    let [near, median, far] = c.distance;
    format!(
        "{}; focal length {}{view}; distance {near:.d$} to {far:.d$}, median {median:.d$}",
        c.lenses.join(", "),
        range(c.focal, "pixels"),
        d = decimals(near, 3),
    )
}

fn masks(i: &Inspection) -> String {
    let Some(m) = &i.masks else { return "none".to_owned() };
    format!("{} of {} views; white: {}", m.count, i.views.total, white_means(m.meaning))
}

/// What white means in masks of this meaning.
pub(super) fn white_means(meaning: &str) -> &'static str {
    match meaning {
        "refractive" => "the refractive object is seen first",
        "keep" => "the pixel is used",
        _ => "the pixel is ignored",
    }
}

/// "[-1 1] × [-1 1] × [0 2]".
fn box_text([low, high]: &[[f64; 3]; 2]) -> String {
    let d = decimals((0..3).map(|a| high[a] - low[a]).fold(0.0, f64::max), 3);
    let sides: Vec<String> = (0..3).map(|a| format!("[{:.d$} {:.d$}]", low[a], high[a])).collect();
    sides.join(" × ")
}
