//! Doubts about what photographs and masks show.

use super::compared::Compared;
use super::doubt::{Doubt, Kind};
use super::look::Look;
use super::measures::{MaskMeasures, Measures};
use super::statistics::{median, spread};
use refraxel_data::inspect::Finding;
use refraxel_data::{MaskMeaning, Severity, View};

/// Sharpness, as a part of that of the neighbours, below which a photograph is blurred: a Gaussian blur of 0.7
/// pixels leaves 0.4 to 0.6, and photographs that were focused rightly have 0.7 and more.
const BLURRED: f64 = 0.6;
/// Least difference from the neighbours that counts as one of exposure [stop].
const EXPOSED: f64 = 0.75;
/// Difference from the neighbours, in spreads of all views, that is out of the ordinary.
const UNUSUAL: f64 = 4.0;
/// Spread of brightness at which all photographs are exposed differently [stop].
const UNEVEN: f64 = 0.35;
/// Share of black or white pixels at which a photograph shows nothing.
const NOTHING: f64 = 0.9;
/// Standard deviation of the luma below which it shows one colour [level of 255].
const PLAIN: f64 = 2.0;
/// Share of overexposed pixels that is doubted, and by how much more than usual that is.
const CLIPPED: [f64; 2] = [0.3, 0.25];
/// Shares of a refractive mask: of an empty one, and of one that covers everything.
const EMPTY: f64 = 1e-5;
const FULL: f64 = 0.95;
/// Ratio of a mask's share to that of the neighbours that is doubted, where these cover at least so much.
const ODD: f64 = 4.0;
const COVERED: f64 = 0.01;
/// Share of the border of a photograph that its mask reaches where it is cut off.
const CUT: f64 = 0.02;

/// The usual numbers of the photographs looked at.
struct Usual {
    stops: f64,
    octaves: f64,
    black: f64,
    white: f64,
}

/// What is doubted of each view, in the order of the looks, and what is said of all.
pub fn doubts(
    views: &[View],
    names: &[String],
    looks: &[Look],
    compared: &[Compared],
) -> (Vec<Doubt>, Vec<Finding>) {
    let measures = || looks.iter().filter_map(|l| l.measures.as_ref().ok());
    let octaves = compared.iter().filter_map(|c| c.sharpness_ratio).map(f64::log2);
    let usual = Usual {
        stops: spread(compared.iter().filter_map(|c| c.stops)),
        octaves: spread(octaves),
        black: median(measures().map(|m| m.black)).unwrap_or(0.0),
        white: median(measures().map(|m| m.white)).unwrap_or(0.0),
    };
    let mut found = Vec::new();
    for (look, compared) in looks.iter().zip(compared) {
        let mut add = |(kind, message, short): (Kind, String, String)| {
            found.push(Doubt { view: look.view, kind, message, short });
        };
        match &look.measures {
            Err(error) => add((
                Kind::Unreadable,
                format!("{error}; training will refuse it: replace the photograph or leave it out"),
                "cannot be decoded".to_owned(),
            )),
            Ok(measures) => {
                let name = &names[look.view];
                let photograph = of_photograph(name, measures, compared, &usual);
                photograph.into_iter().for_each(&mut add);
                if let Some(mask) = measures.mask {
                    of_mask(name, mask, views[look.view].mask_meaning, compared)
                        .into_iter()
                        .for_each(&mut add);
                }
            }
        }
    }
    (found, uneven(usual.stops).into_iter().collect())
}

fn uneven(stops: f64) -> Option<Finding> {
    let message = format!(
        "the brightness of the photographs differs by {stops:.1} stops from that of their neighbours (median): if \
        exposure was not fixed, use --exposure learn"
    );
    (stops > UNEVEN).then(|| Finding { severity: Severity::Note.name(), message })
}

type Told = (Kind, String, String);

fn of_photograph(name: &str, m: &Measures, compared: &Compared, usual: &Usual) -> Vec<Told> {
    if let Some(empty) = empty(name, m, usual) {
        return vec![empty];
    }
    let mut told = Vec::new();
    if let Some(ratio) = compared.sharpness_ratio
        && ratio < BLURRED
        && ratio.log2() < -UNUSUAL * usual.octaves
    {
        let message = format!(
            "{name} is blurred: its sharpness is {ratio:.2} of the median of its neighbours; leave it out"
        );
        told.push((Kind::Blurred, message, format!("blurred, {ratio:.2}")));
    }
    let exposed = compared.stops.filter(|s| s.abs() > EXPOSED.max(UNUSUAL * usual.stops));
    if let Some(stops) = exposed {
        let how = if stops < 0.0 { "darker" } else { "brighter" };
        let stops = stops.abs();
        let message = format!(
            "{name} is {stops:.1} stops {how} than its neighbours: use --exposure learn, or leave it out"
        );
        told.push((Kind::Exposed, message, format!("{stops:.1} stops {how}")));
    }
    if m.white > CLIPPED[0] && m.white > usual.white + CLIPPED[1] {
        let [share, others] = [m.white, usual.white].map(|s| 100.0 * s);
        let message = format!(
            "{name} is overexposed: {share:.0} % of it is white, and {others:.0} % of most others; leave it out"
        );
        told.push((Kind::Clipped, message, format!("{share:.0} % white")));
    }
    told
}

fn empty(name: &str, m: &Measures, usual: &Usual) -> Option<Told> {
    let tell = |what: &str, short: &str| {
        let message = format!("{name} shows nothing: {what}; leave it out");
        Some((Kind::Empty, message, short.to_owned()))
    };
    let share = |share: f64, colour: &str| {
        let share = format!("{:.0} %", 100.0 * share);
        tell(&format!("{share} of it is {colour}"), &format!("{share} {colour}"))
    };
    if m.brightness.is_none() {
        // What a mask leaves out is told as the mask's fault.
        return if m.mask.is_none() { tell("all of it is backdrop", "shows nothing") } else { None };
    }
    if m.black > NOTHING && usual.black < 0.5 * NOTHING {
        return share(m.black, "black");
    }
    if m.white > NOTHING && usual.white < 0.5 * NOTHING {
        return share(m.white, "white");
    }
    if m.contrast < PLAIN { tell("it has one colour", "one colour") } else { None }
}

fn of_mask(name: &str, mask: MaskMeasures, meaning: MaskMeaning, compared: &Compared) -> Vec<Told> {
    let used = match meaning {
        MaskMeaning::Refractive => return of_refractive(name, mask, compared),
        MaskMeaning::Keep => mask.white,
        MaskMeaning::Ignore => 1.0 - mask.white,
    };
    let message = format!(
        "the mask of {name} leaves out the whole photograph: correct the mask, or say --mask-meaning ignore or keep \
        for all"
    );
    let is_empty = used < EMPTY;
    is_empty.then(|| (Kind::MaskEmpty, message, "mask: nothing is used".to_owned())).into_iter().collect()
}

fn of_refractive(name: &str, mask: MaskMeasures, compared: &Compared) -> Vec<Told> {
    let white = 100.0 * mask.white;
    if mask.white < EMPTY {
        let message = format!(
            "the mask of {name} is empty, so that nothing refractive is seen there: if that is wrong, correct it, or \
            delete it so that the other masks tell"
        );
        return vec![(Kind::MaskEmpty, message, "mask is empty".to_owned())];
    }
    if mask.white > FULL {
        let message = format!(
            "the mask of {name} covers {white:.0} % of the photograph: say --mask-meaning keep if white means that a \
            pixel is used"
        );
        return vec![(Kind::MaskFull, message, format!("mask: {white:.0} %"))];
    }
    let mut told = Vec::new();
    let odd = |others: &f64| *others > COVERED && !(1.0 / ODD..=ODD).contains(&(mask.white / others));
    if let Some(others) = compared.mask.filter(odd) {
        let others = 100.0 * others;
        let message = format!(
            "the mask of {name} covers {white:.1} % of the photograph, and those of its neighbours {others:.1} %: \
            correct it, or delete it"
        );
        told.push((Kind::MaskOdd, message, format!("mask: {white:.1} %")));
    }
    if mask.white_border > CUT {
        let message = format!(
            "the mask of {name} reaches the border of the photograph: the outline is cut off there; keep whole \
            bodies in the picture"
        );
        told.push((Kind::MaskCut, message, "mask is cut off".to_owned()));
    }
    told
}
