//! How photographs are read, as the arguments and the run that goes on say; and the photographs themselves.

use crate::cli::{ReadingArgs, TrainArgs};
use crate::exit::{Exit, Failure};
use crate::progress::Show;
use crate::verbs::dataset::{data_failure, open_options, reduce, reduce_or_fit, say_findings};
use crate::verbs::files::absolute;
use refraxel_data::{Dataset, OpenOptions};
use refraxel_train::run::{Run, Source};

pub(super) const NOT_SCORED: &str = "no images are held out: the run is not scored";

/// Whether some photographs are held out, by which a run is scored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeldOut {
    /// None is.
    No,
    /// Some are.
    Yes,
}

/// What a training is given.
pub(super) struct Input {
    pub(super) data: Dataset,
    pub(super) source: Source,
    pub(super) held_out: HeldOut,
}

/// Reads the photographs that are named, as the run that goes on has read them.
pub(super) fn read(args: &TrainArgs, saved: Option<&Run>, show: Show) -> Result<Input, Failure> {
    let before = saved.map(|run| &run.source);
    let crop = as_before(
        "--crop",
        args.reading.crop.filter(|c| !c.is_none()),
        before.map(|s| s.crop),
        |c| c.to_string(),
        args,
    )?;
    let components = |up: [f64; 3]| up.map(|c| c.to_string()).join(",");
    let up = as_before("--up", args.reading.up, before.map(|s| s.up), components, args)?;
    let backdrop = as_before(
        "--backdrop",
        args.reading.backdrop,
        before.map(Source::backdrop),
        |b| b.to_string(),
        args,
    )?;
    let alpha = as_before("--alpha", args.reading.alpha, before.map(Source::alpha), |a| a.to_string(), args)?;
    let reduced = args.downscale.map(u32::from);
    let downscale = as_before("--downscale", reduced, before.map(|s| s.downscale), |n| n.to_string(), args)?;
    let (asked, stored) = (args.reading.orientation, before.map(|s| s.orientation));
    let orientation = as_before("--orientation", asked, stored, |o| o.name().to_owned(), args)?;
    let reading =
        open_options(&ReadingArgs { crop, up, backdrop, alpha, orientation, ..args.reading.clone() });
    let reading = OpenOptions { origin: saved.map(|run| run.plan.origin), ..reading };
    let mut data = Dataset::open(args.data(), &reading).map_err(data_failure)?;
    let downscale = match before {
        Some(_) => reduce(&mut data, downscale, args.data(), show).map(|()| downscale)?,
        None => reduce_or_fit(&mut data, downscale, args.data(), show)?,
    };
    say_findings(&data, show);
    let held_out = if data.split.test.is_empty() { HeldOut::No } else { HeldOut::Yes };
    if held_out == HeldOut::No {
        let rule = &data.split.rule;
        show.say(&format!("note: {NOT_SCORED} ({rule}); name some for testing to learn how good it is"));
    }
    let mut source = Source::of_files(absolute(args.data()), &reading, &data);
    source.downscale = downscale;
    let earlier = saved.and_then(|run| run.source.index_from.clone());
    source.index_from = args.index_from.as_deref().map(absolute).or(earlier);
    Ok(Input { data, source, held_out })
}

/// How photographs are read: as the run that goes on says.
fn as_before<T: Copy + PartialEq>(
    flag: &str,
    asked: Option<T>,
    stored: Option<Option<T>>,
    text: impl Fn(T) -> String,
    args: &TrainArgs,
) -> Result<Option<T>, Failure> {
    let Some(stored) = stored else { return Ok(asked) };
    if asked.is_none() || asked == stored {
        return Ok(stored);
    }
    let was = stored.map_or_else(|| format!("without {flag}"), |v| format!("with {flag} {}", text(v)));
    Err(Exit::BadInput.because(format!(
        "{} was trained {was}; --resume continues so: leave {flag} out, or start a new run",
        args.out().display()
    )))
}
