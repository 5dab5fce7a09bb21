//! What the alpha channels of photographs mean, by the colours below alpha 0: one colour is what a cut-out leaves, a photograph that
//! goes on below is masked.

use crate::decoding::Header;
use crate::looks::{Look, SAME, common_colour, is_within, rgb};
use crate::parsed::{Frame, ParsedDataset, Part};
use crate::{AlphaMeaning, OpenOptions, Problem};
use std::fmt;
use std::str::FromStr;

/// Alpha from which a pixel counts as opaque: exporters round.
const OPAQUE: f32 = 0.98;
/// Alpha up to which nothing is there: 1 of 255, where a 1 was meant to be all.
const NONE: f32 = 1.01 / 255.0;
/// Alpha that varies less than this is the same everywhere: rounding and dithering change it by 1 of 255 to either side.
const CONSTANT: f32 = 2.01 / 255.0;
/// What is cut out stands before nothing, so that not as much of the borders is opaque.
const FILLED: f64 = 0.97;
/// Alpha of half-covered pixels. Fainter ones have colours of few levels, and fuller ones could be of nearly any colour.
const HALF: std::ops::Range<f32> = 0.05..0.95;
/// Multiplied colours exceed their alpha by rounding alone, by up to 2 of 255.
const ROUNDING: f32 = 2.55 / 255.0;
/// Half-covered pixels that should be brighter than their alpha, at least, before it is said that none is: of so many, chance leaves
/// out all once in 100,000 times.
const BRIGHTER: f64 = 12.0;
/// Divided by their alpha, multiplied colours are as bright as opaque ones; darker ones than this factor are those of dark outlines.
const OUTLINE: f64 = 0.5;
/// One colour has at least this share of the pixels below alpha 0 of a cut-out.
const PLAIN: f64 = 0.9;
/// A photograph changes less than this from pixel to pixel, compared with pixels that are far apart; noise changes as much.
const SMOOTH: f64 = 0.8;

/// What alpha means, if some photographs have it, and what is to be said of that.
pub(crate) struct Decided {
    pub meaning: Option<AlphaMeaning>,
    pub problems: Vec<Problem>,
}

/// Decides by what the photographs that were looked at have below alpha 0, unless somebody says it.
pub(crate) fn decide(
    parsed: &ParsedDataset,
    headers: &[Header],
    looks: &[Look],
    options: &OpenOptions,
) -> Decided {
    let with = headers.iter().filter(|h| h.alpha).count();
    if with == 0 {
        return Decided { meaning: None, problems: Vec::new() };
    }
    let without = headers.len() - with;
    let learns = |frame: &Frame| frame.part == Some(Part::Train);
    let training = |alpha: bool| {
        parsed.frames.iter().zip(headers).filter(|(f, h)| learns(f) && h.alpha == alpha).count()
    };
    let looks: Vec<&Look> = looks.iter().filter(|l| headers[l.view].alpha).collect();
    let (meaning, why) = match options.alpha {
        Some(stated) => (stated, None),
        None => match concluded(&looks, parsed.is_rendered()) {
            (AlphaMeaning::Backdrop, _) if training(true) < training(false) => {
                (AlphaMeaning::Ignore, Some(of_few(with, without)))
            }
            concluded => concluded,
        },
    };
    let mut problems: Vec<Problem> = why.into_iter().collect();
    problems.extend(multiplied(&looks).filter(|_| meaning == AlphaMeaning::Backdrop));
    if meaning != AlphaMeaning::Ignore && without > 0 {
        problems.push(Problem::warning(format!(
            "{without} of {} photographs have no alpha channel: all of their pixels count as opaque",
            headers.len()
        )));
    }
    Decided { meaning: Some(meaning), problems }
}

/// A warning about cut-outs among more photographs that are none: they say nothing of what is behind all of them.
fn of_few(with: usize, without: usize) -> Problem {
    Problem::warning(format!(
        "only {with} of {} photographs have an alpha channel: it is left out, and all of their pixels are used; give all photographs one, or \
         none (--alpha backdrop takes what it covers for empty space)",
        with + without
    ))
}

/// A warning where colours were multiplied by alpha: half-covered pixels are then never brighter than it, although enough of what is
/// opaque is, and not darker than that either.
fn multiplied(looks: &[&Look]) -> Option<Problem> {
    let samples = || looks.iter().flat_map(|l| l.samples.iter().map(|[here, _]| *here));
    let brightest = |[r, g, b, _]: [f32; 4]| r.max(g).max(b);
    let mut opaque: Vec<f32> = samples().filter(|p| p[3] >= OPAQUE).map(brightest).collect();
    opaque.sort_by(f32::total_cmp);
    let half = || samples().filter(|p| HALF.contains(&p[3]));
    let brighter = |p: [f32; 4]| opaque.len() - opaque.partition_point(|v| *v <= p[3] + ROUNDING);
    let expected = half().map(|p| brighter(p) as f64).sum::<f64>() / opaque.len().max(1) as f64;
    let usual = sum(opaque.iter().copied()) / opaque.len().max(1) as f64;
    let is_as_bright = sum(half().map(brightest)) > OUTLINE * usual * sum(half().map(|p| p[3]));
    let is_multiplied =
        expected > BRIGHTER && is_as_bright && half().all(|p| brightest(p) <= p[3] + ROUNDING);
    is_multiplied.then(|| {
        Problem::warning(
            "no half-covered pixel is brighter than its alpha, as where colours are multiplied by alpha already (premultiplied): the \
             outlines will be too dark; export the photographs with straight alpha",
        )
    })
}

fn sum(values: impl Iterator<Item = f32>) -> f64 {
    values.map(f64::from).sum()
}

/// `backdrop`, `mask` or `ignore`.
impl fmt::Display for AlphaMeaning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            AlphaMeaning::Backdrop => "backdrop",
            AlphaMeaning::Mask => "mask",
            AlphaMeaning::Ignore => "ignore",
        })
    }
}

/// A text that is no [`AlphaMeaning`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected backdrop, mask or ignore")]
pub struct NoAlphaMeaning;

impl FromStr for AlphaMeaning {
    type Err = NoAlphaMeaning;

    fn from_str(text: &str) -> Result<Self, NoAlphaMeaning> {
        let all = [AlphaMeaning::Backdrop, AlphaMeaning::Mask, AlphaMeaning::Ignore];
        all.into_iter().find(|meaning| meaning.to_string() == text).ok_or(NoAlphaMeaning)
    }
}

fn concluded(looks: &[&Look], are_rendered: bool) -> (AlphaMeaning, Option<Problem>) {
    let alpha = || looks.iter().flat_map(|l| l.samples.iter().map(|[here, _]| here[3]));
    if alpha().all(|a| a >= OPAQUE) {
        return (AlphaMeaning::Ignore, None);
    }
    if alpha().all(|a| a <= NONE) {
        let message = "the alpha of all photographs that were looked at is 0 or 1 of 255 everywhere, as a faulty export leaves it: it is \
                       left out (--alpha backdrop says that nothing is to be seen)";
        return (AlphaMeaning::Ignore, Some(Problem::warning(message)));
    }
    let (least, most) = alpha().fold((1.0, 0.0), |(least, most): (f32, f32), a| (least.min(a), most.max(a)));
    if most - least < CONSTANT {
        let message = format!(
            "the alpha of all photographs that were looked at is {:.0} % everywhere, which says nothing: it is left out (--alpha backdrop \
             takes them for half transparent)",
            100.0 * most
        );
        return (AlphaMeaning::Ignore, Some(Problem::warning(message)));
    }
    let below: Vec<Below> = looks.iter().filter_map(|look| Below::of(look)).collect();
    let photographs = below.iter().filter(|b| b.is_photograph()).count();
    let plain = below.iter().map(|b| b.plain).sum::<f64>() / below.len().max(1) as f64;
    if 2 * photographs > below.len() {
        let message = format!(
            "alpha covers parts of whole photographs: {:.0} % of the pixels below alpha 0 have one colour, the others show something; \
             it is taken for a mask (--alpha backdrop takes what it covers for empty space)",
            100.0 * plain
        );
        return (AlphaMeaning::Mask, Some(Problem::note(message)));
    }
    // A renderer knows that nothing is there, as beside a ground that reaches all borders.
    match holes(looks).filter(|_| !are_rendered) {
        Some(holes) => (AlphaMeaning::Mask, Some(holes)),
        None => (AlphaMeaning::Backdrop, None),
    }
}

/// A warning where the borders of the photographs are opaque, so that nothing was cut out around a thing.
fn holes(looks: &[&Look]) -> Option<Problem> {
    let border = || looks.iter().flat_map(|l| l.border.iter().map(|pixel| pixel[3]));
    let filled = border().filter(|a| *a >= OPAQUE).count() as f64 / border().count().max(1) as f64;
    (filled > FILLED).then(|| {
        Problem::warning(format!(
            "{:.0} % of the borders of the photographs are opaque, so that alpha cuts holes into whole photographs: it is taken for a mask, \
             and the holes are not used (--alpha backdrop takes them for empty space)",
            100.0 * filled
        ))
    })
}

/// The colours of a photograph below alpha 0.
struct Below {
    /// Share of the most frequent one.
    plain: f64,
    /// How much neighbours differ, compared with pixels that are far apart.
    roughness: f64,
}

impl Below {
    fn of(look: &Look) -> Option<Self> {
        let hidden: Vec<[[f32; 3]; 2]> = look
            .samples
            .iter()
            .filter(|pair| pair.iter().all(|p| p[3] <= 0.0))
            .map(|pair| pair.map(rgb))
            .collect();
        let common = common_colour(hidden.iter().map(|pair| pair[0]))?;
        let same = hidden.iter().filter(|pair| is_within(pair[0], common, SAME)).count();
        let count = hidden.len();
        let apart =
            |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>();
        let neighbours: f64 = hidden.iter().map(|[here, next]| apart(*here, *next)).sum();
        // A shift by a number that is prime to most widths leads to another row and column.
        let far: f64 = (0..count).map(|k| apart(hidden[k][0], hidden[(k + count / 2 + 7) % count][0])).sum();
        Some(Self { plain: same as f64 / count as f64, roughness: neighbours / far.max(f64::MIN_POSITIVE) })
    }

    fn is_photograph(&self) -> bool {
        self.plain < PLAIN && self.roughness < SMOOTH
    }
}
