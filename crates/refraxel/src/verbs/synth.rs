//! `refraxel synth`: makes datasets with the exact tracer.

use super::interrupts::{interrupted, watch_for_interrupts};
use super::threads::set_threads;
use crate::cli::SynthArgs;
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::{Progress, Show};
use crate::table::{Table, count, score};
use refraxel_data::synth::{
    Imperfections, Progress as Done, Reflection, SceneInfo, Summary, SynthError, SynthOptions, ViewCounts,
    room_list, scene_list, synthesize,
};
use serde::Serialize;
use std::ops::ControlFlow;
use std::sync::Mutex;

/// The verb.
pub fn run(args: &SynthArgs) -> Result<(), Failure> {
    let console = Console::new(args.work.json);
    if args.list {
        return list(console);
    }
    let (Some(scene), Some(out)) = (&args.scene, &args.out) else {
        return Err(Exit::Usage.because("give a scene and --out DIR, or --list"));
    };
    set_threads(&args.work)?;
    watch_for_interrupts()?;
    let usual = if args.photographic { SynthOptions::photographs } else { SynthOptions::new };
    let options = options(args, usual(scene, out.clone()));
    let summary = make(&options, Show::suited(args.work.quiet || args.work.json))?;
    let report = Report::new(&options, &summary);
    console.result(&report.text(), &report).or_exit(Exit::Io)
}

/// Makes a dataset with a progress bar; Ctrl-C keeps the finished pictures.
pub fn make(options: &SynthOptions, show: Show) -> Result<Summary, Failure> {
    let bar: Mutex<Option<Progress>> = Mutex::new(None);
    let hear = |done: Done| {
        if let Ok(mut bar) = bar.lock() {
            let bar = bar.get_or_insert_with(|| Progress::new(show, "pictures", done.total as u64));
            bar.set(done.done as u64, &options.scene);
        }
        if interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let made = synthesize(options, &hear);
    if let Ok(Some(bar)) = bar.into_inner() {
        match &made {
            Ok(_) => bar.finish(&options.scene),
            Err(_) => bar.abandon(&options.scene),
        }
    }
    made.map_err(failure)
}

fn options(args: &SynthArgs, usual: SynthOptions) -> SynthOptions {
    let train = args.views.map_or(usual.views.train, |n| n as usize);
    let views = match args.photographic {
        true => ViewCounts { train, val: 0, test: (4 * train).div_ceil(15) },
        false => ViewCounts { train, val: train.div_ceil(10), test: (2 * train).div_ceil(5) },
    };
    let without = |with| args.without.iter().fold(with, |rest: Imperfections, &one| rest.without(one));
    SynthOptions {
        size: args.size.unwrap_or(usual.size),
        views,
        seed: args.seed,
        ior: args.ior,
        reflection: if args.reflection.is_on() { Reflection::On } else { Reflection::Off },
        cameras: args.cameras,
        spp: args.spp.unwrap_or(usual.spp),
        detail_spp: args.detail_spp.unwrap_or(usual.detail_spp),
        exr: args.exr,
        index_resolution: args.index_resolution.unwrap_or(usual.index_resolution),
        mesh: args.mesh.clone(),
        photographic: usual.photographic.map(without),
        ..usual
    }
}

fn failure(error: SynthError) -> Failure {
    let exit = match &error {
        SynthError::UnknownScene { .. } | SynthError::Range { .. } => Exit::Usage,
        SynthError::Foreign { .. } | SynthError::Mesh { .. } => Exit::BadInput,
        SynthError::Io { action: "read", .. } => Exit::BadInput,
        SynthError::Io { .. } | SynthError::Write(_) => Exit::Io,
        SynthError::Picture { .. } | SynthError::Threads { .. } => Exit::Io,
        SynthError::Stopped { .. } => Exit::Interrupted,
    };
    Failure::new(exit, error)
}

#[derive(Serialize)]
struct Report {
    scene: String,
    out: String,
    /// Training, validation and test views.
    views: [usize; 3],
    /// Width of the pictures.
    size: u32,
    height: u32,
    rendered: usize,
    kept: usize,
    seconds: f64,
    camera_rays: u64,
    rays_per_s: Option<f64>,
    lost_energy: f64,
}

impl Report {
    fn new(options: &SynthOptions, summary: &Summary) -> Self {
        let (cost, views) = (&summary.cost, &options.views);
        Self {
            scene: options.scene.clone(),
            out: summary.out.display().to_string(),
            views: [views.train, views.val, views.test],
            size: options.size,
            height: options.picture_size()[1],
            rendered: summary.rendered,
            kept: summary.kept,
            seconds: cost.seconds,
            camera_rays: cost.samples,
            rays_per_s: Some(cost.rays_per_second()).filter(|r| r.is_finite() && cost.samples > 0),
            lost_energy: summary.lost_energy,
        }
    }

    fn text(&self) -> String {
        let ([train, val, test], width, height) = (self.views, self.size, self.height);
        let speed = self.rays_per_s.map_or(String::new(), |r| {
            format!(" in {:.1} s, {:.2} million camera rays per second", self.seconds, r / 1e6)
        });
        format!(
            "{} in {}: {train} training, {val} validation and {test} test views of {width}×{height} pixels\n\
             rendered {} pictures{speed}; kept {} of an earlier run\n\
             share of light lost at the depth limit: {:.1e}\n\
             contact sheet: {out}/contact.png, truth: {out}/scene.json",
            self.scene,
            self.out,
            count(self.rendered as u64),
            self.kept,
            self.lost_energy,
            out = self.out,
        )
    }
}

#[derive(Serialize)]
struct Listed {
    name: &'static str,
    shows: &'static str,
    /// A room, which only `--photographic` shows.
    is_room: bool,
    /// The usual index, where one can be chosen, and the smallest and largest.
    ior: Option<f64>,
    ior_range: Option<[f64; 2]>,
}

impl Listed {
    fn new(info: &SceneInfo, is_room: bool) -> Listed {
        let ior_range = info.ior.map(|r| [r.min, r.max]);
        Listed { name: info.name, shows: info.shows, is_room, ior: info.ior.map(|r| r.default), ior_range }
    }
}

fn list(console: Console) -> Result<(), Failure> {
    let mut table = Table::new(&["scene", "index", "  shows"]);
    let scenes = scene_list().into_iter().map(|info| Listed::new(&info, false));
    let all: Vec<Listed> = scenes.chain(room_list().iter().map(|info| Listed::new(info, true))).collect();
    for listed in &all {
        table.row(vec![listed.name.to_owned(), score(listed.ior, 2)]);
    }
    // The last column is prose: it stands left.
    let lines = table.text();
    let shows = |l: &Listed| format!("{}{}", if l.is_room { "room (--photographic): " } else { "" }, l.shows);
    let prose = std::iter::once("shows".to_owned()).chain(all.iter().map(shows));
    let text: Vec<String> = lines
        .lines()
        .zip(prose)
        .map(|(line, shows)| format!("{:<20}  {shows}", line.trim_end_matches("shows").trim_end()))
        .collect();
    console.result(&text.join("\n"), &all).or_exit(Exit::Io)
}
