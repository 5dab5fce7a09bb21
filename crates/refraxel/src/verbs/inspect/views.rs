//! The views of a dataset one by one: what they show, and what is doubted about them.

use super::compared::{Compared, compare};
use super::doubt::{Doubt, told};
use super::look::{Look, MOST, evenly, look};
use super::names::{labels, parts};
use super::{of_cameras, of_photographs, same};
use crate::exit::Failure;
use crate::progress::Show;
use refraxel_core::Vec3;
use refraxel_data::inspect::Finding;
use refraxel_data::{Dataset, Region};
use serde::Serialize;
use std::collections::HashMap;

/// All that is known about the views.
pub struct Views {
    /// What each view is called, and its part of the split.
    pub names: Vec<String>,
    pub parts: Vec<&'static str>,
    /// The photographs that were looked at, each beside its neighbours.
    pub looks: Vec<Look>,
    pub compared: Vec<Compared>,
    /// By view.
    pub doubts: Vec<Doubt>,
    /// About all of them.
    pub findings: Vec<Finding>,
    /// Where the cameras extend farthest.
    pub along: Vec3<f64>,
    position: HashMap<usize, usize>,
}

/// One view, for programs.
#[derive(Serialize)]
pub struct ViewReport {
    pub name: String,
    pub part: &'static str,
    /// Mean brightness of the pixels that are used, sRGB, 1 = white. This and what follows is `null` where nobody
    /// looked.
    pub brightness: Option<f64>,
    /// How much brighter than its neighbours [stop].
    pub stops: Option<f64>,
    /// Fine detail as a part of coarser detail.
    pub sharpness: Option<f64>,
    /// The same as a part of the median of the neighbours.
    pub sharpness_ratio: Option<f64>,
    /// Share of the photograph in which its mask is white.
    pub mask: Option<f64>,
    /// Sentences.
    pub warnings: Vec<String>,
}

impl Views {
    /// Looks at all views, or at most at so many that it is quick; keeps small pictures with the former.
    pub fn look_at(data: &Dataset, region: &Region, all: bool, show: Show) -> Result<Self, Failure> {
        let (names, parts) = (labels(data), parts(data));
        let most = if all { usize::MAX } else { MOST };
        let looks = look(data, &evenly(data.views.len(), most), all, show)?;
        let layout = of_cameras::layout(&data.views, &names, region);
        let compared = compare(&data.views, &looks, layout.distance);
        let (mut doubts, mut findings) = of_photographs::doubts(&data.views, &names, &looks, &compared);
        doubts.extend(same::doubts(&data.views, &names, &parts, &looks, &compared, layout.distance));
        doubts.extend(layout.doubts);
        findings.extend(layout.findings);
        let position = looks.iter().enumerate().map(|(k, l)| (l.view, k)).collect();
        Ok(Self { names, parts, looks, compared, doubts, findings, along: layout.along, position })
    }

    /// The doubts about a view, the worst first.
    pub fn of(&self, view: usize) -> impl Iterator<Item = &Doubt> {
        let mut found: Vec<&Doubt> = self.doubts.iter().filter(|d| d.view == view).collect();
        found.sort_by_key(|d| d.kind);
        found.into_iter()
    }

    /// Where the look at a view is in the list.
    ///
    /// # Panics
    /// When nobody looked at it.
    pub fn position(&self, view: usize) -> usize {
        self.position[&view]
    }

    /// Everything that is doubted, as lines.
    pub fn told(&self) -> Vec<Finding> {
        let mut lines = told(&self.doubts);
        lines.extend(self.findings.iter().cloned());
        lines
    }

    /// One view for programs.
    pub fn report(&self) -> Vec<ViewReport> {
        (0..self.names.len()).map(|view| self.report_of(view)).collect()
    }

    fn report_of(&self, view: usize) -> ViewReport {
        let position = self.position.get(&view);
        let measures = position.and_then(|&k| self.looks[k].measures.as_ref().ok());
        let compared = position.map(|&k| &self.compared[k]);
        ViewReport {
            name: self.names[view].clone(),
            part: self.parts[view],
            brightness: measures.and_then(|m| m.brightness),
            stops: compared.and_then(|c| c.stops),
            sharpness: measures.and_then(|m| m.sharpness),
            sharpness_ratio: compared.and_then(|c| c.sharpness_ratio),
            mask: measures.and_then(|m| m.mask).map(|m| m.white),
            warnings: self.of(view).map(|d| d.message.clone()).collect(),
        }
    }
}
