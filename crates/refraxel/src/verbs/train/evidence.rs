//! What a verdict by prediction rests on, as a picture: RUN/evidence.png.

use crate::picture::{Content, Panel, Row, Sheet};
use refraxel_data::atomic::WriteError;
use refraxel_train::events::Shown;
use refraxel_train::metrics::Rgb8;
use std::path::Path;

/// Name of the picture in the folder of a run.
pub const EVIDENCE: &str = "evidence.png";

/// Draws a row per body: photograph, straight through, prediction. Nothing is written where there is none.
pub fn draw(pictures: &[Shown], out: &Path) -> Result<(), WriteError> {
    if pictures.is_empty() {
        return Ok(());
    }
    let sheet = Sheet {
        title: "Prediction before anything of the glass has learned".to_owned(),
        columns: ["photograph", "straight through", "prediction"].map(str::to_owned).to_vec(),
        rows: pictures.iter().map(|shown| Row { panels: panels(shown), ..Row::default() }).collect(),
    };
    sheet.draw().save_png(&out.join(EVIDENCE))
}

fn panels(shown: &Shown) -> Vec<Panel<'_>> {
    let panel = |pixels, note| {
        let content = Content::Image(Rgb8::new(pixels, shown.size[0], shown.size[1]));
        Panel { content, note }
    };
    let likeness = |score: f64| format!("likeness {score:.2}");
    vec![
        panel(&shown.photograph, format!("region {}, {}", shown.region + 1, shown.view)),
        panel(&shown.straight_through.0, likeness(shown.straight_through.1)),
        panel(&shown.predicted.0, likeness(shown.predicted.1)),
    ]
}
