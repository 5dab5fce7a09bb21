//! What lies behind everything else: what is stated, else what the borders of a few photographs show.

use crate::looks::{Look, MaskLook, SAME, common_colour, is_within, median_colour, rgb};
use crate::naming::first_few;
use crate::parsed::ParsedDataset;
use crate::quantize::quantize;
use crate::{Backdrop, MaskMeaning, OpenOptions, Problem, View};
use serde_json::Value;
use std::fmt;
use std::str::FromStr;

/// Renderings have the colour of their backdrop on at least this share of their borders; ground and things reach the rest.
const RENDERED: f64 = 0.4;
/// Photographs, of which nothing says that they are renderings, on at least this share, and each one on at least [`EACH`].
const PHOTOGRAPHED: f64 = 0.9;
const EACH: f64 = 0.8;
/// A rendering with less than this share of the common colour is named.
const LITTLE: f64 = 0.1;
/// Levels of 255 to which shaded paper is of one colour.
const SHADED: f32 = 24.0;
/// Levels of 255 from the backdrop beyond which a pixel shows something.
const SHOWN: f32 = 16.0;
/// Fewest pixels of a border that say anything.
const FEWEST: usize = 40;
/// Pixels of a piece of a border, whose median counts, and of about a side of a small picture.
const PIECE: usize = 8;
const SIDE: usize = 48;
/// Levels of 255 by which JPEG changes medians of pieces beside things, but not those of sides, as shades do.
const RINGING: f32 = 10.0;

/// What the decision rests on.
pub(crate) struct Evidence<'a> {
    pub parsed: &'a ParsedDataset,
    pub truth: Option<&'a Value>,
    pub views: &'a [View],
    pub looks: &'a [Look],
    /// The masks of the photographs that were looked at.
    pub masks: &'a [Option<MaskLook>],
    /// Alpha says where nothing is.
    pub is_cut_out: bool,
}

/// The backdrop, from the first of these that says one: the user, alpha, the description, the truth, the borders of the photographs.
pub(crate) fn decide(evidence: &Evidence, options: &OpenOptions) -> (Backdrop, Option<Problem>) {
    if let Some(chosen) = options.backdrop {
        return (chosen, None);
    }
    if evidence.is_cut_out {
        return (Backdrop::Transparent, None);
    }
    let borders = Borders::of(evidence);
    if let Some(stated) = evidence.parsed.backdrop.or_else(|| truth_background(evidence.truth?)) {
        return (stated, borders.and_then(|b| b.doubt(stated)));
    }
    let is_rendered = evidence.parsed.is_rendered();
    match borders {
        Some(borders) if is_rendered => borders.of_rendering(),
        Some(borders) => borders.of_photographs(),
        None if is_rendered => (Backdrop::Color([1.0; 3]), None),
        None => (Backdrop::Surroundings, None),
    }
}

/// `background_srgb8` of `scene.json`.
fn truth_background(truth: &Value) -> Option<Backdrop> {
    let rgb = truth.get("background_srgb8")?.as_array()?;
    let color: Vec<f32> = rgb.iter().filter_map(Value::as_f64).map(|c| (c / 255.0) as f32).collect();
    Some(Backdrop::Color(color.try_into().ok()?))
}

/// The borders of the photographs that were looked at, as far as their pixels are used.
struct Borders {
    /// The most frequent colour of all.
    common: [f32; 3],
    /// One per photograph.
    each: Vec<Border>,
    /// Share of all pieces with the common colour, exactly and up to shading.
    same: f64,
    shaded: f64,
}

struct Border {
    name: String,
    /// Share of the common colour.
    same: f64,
    /// Share of the photograph's own most frequent colour.
    own: f64,
}

impl Borders {
    /// `None` where they say nothing: too few pixels are used, or the photographs show nothing else than this colour.
    fn of(evidence: &Evidence) -> Option<Self> {
        let looks = || evidence.looks.iter();
        let used: Vec<Vec<[f32; 3]>> =
            looks().zip(evidence.masks).map(|(look, mask)| used(evidence, look, mask)).collect();
        let common = common_colour(used.iter().flatten().copied())?;
        let shows = |look: &Look| look.samples.iter().any(|[here, _]| !is_within(rgb(*here), common, SHOWN));
        if !looks().any(shows) {
            return None;
        }
        let border = |(look, pixels): (&Look, &Vec<[f32; 3]>)| Border {
            name: evidence.views[look.view].name.clone(),
            same: share(pixels, common),
            own: common_colour(pixels.iter().copied()).map_or(0.0, |own| share(pixels, own)),
        };
        let each: Vec<Border> = looks().zip(&used).map(border).collect();
        let mean = |of: &dyn Fn(usize) -> f64| (0..each.len()).map(of).sum::<f64>() / each.len() as f64;
        let same = mean(&|k| each[k].same);
        let shaded = mean(&|k| share_within(&used[k], PIECE, common, SHADED));
        Some(Self { common, each, same, shaded })
    }

    fn colour(&self) -> Backdrop {
        // Levels of 8 bits are exact, as the median of them is.
        Backdrop::Color(self.common.map(|c| c.clamp(0.0, 1.0)))
    }

    /// `99.7 % of the borders of 12 photographs have the colour #ffffff`.
    fn share(&self) -> String {
        let (percent, count) = (100.0 * self.same, self.each.len());
        format!("{percent:.1} % of the borders of {count} photographs have the colour {}", self.colour())
    }

    /// Renderings stand before one colour, unless their borders say otherwise.
    fn of_rendering(&self) -> (Backdrop, Option<Problem>) {
        if self.same >= RENDERED {
            let reason = format!("backdrop {}: {}", self.colour(), self.share());
            let odd = named(self.each.iter().filter(|b| b.same < LITTLE));
            let problem = match odd {
                Some(odd) => Problem::warning(format!(
                    "{reason}, but hardly any of {odd}; --backdrop surroundings overrides this"
                )),
                None if self.same < PHOTOGRAPHED => Problem::warning(format!(
                    "{reason}, as the layout of renderings suggests, and the others show something; if these are photographs of a place \
                     with surroundings, say --backdrop surroundings"
                )),
                None => Problem::note(reason),
            };
            return (self.colour(), Some(problem));
        }
        let found = if self.is_plain_by_itself() {
            "each photograph has a plain border, but of its own colour".to_owned()
        } else {
            format!("the borders of the photographs show something (only {})", self.share())
        };
        let message = format!(
            "the layout is that of renderings before one colour, but {found}: they are taken for photographs with surroundings; \
             --backdrop '#ffffff' or another colour overrides this"
        );
        (Backdrop::Surroundings, Some(Problem::warning(message)))
    }

    /// Photographs have surroundings, unless all stand before exactly one colour.
    fn of_photographs(&self) -> (Backdrop, Option<Problem>) {
        let plain = |b: &&Border| b.same >= EACH;
        let (plain_ones, count) = (self.each.iter().filter(plain).count(), self.each.len());
        if self.same >= PHOTOGRAPHED && plain_ones == count {
            let reason = format!(
                "backdrop {}: {}; --backdrop surroundings overrides this",
                self.colour(),
                self.share()
            );
            return (self.colour(), Some(Problem::note(reason)));
        }
        let otherwise = format!(
            "they are taken for photographs with surroundings; --backdrop '{}' overrides this",
            self.colour()
        );
        let problem = if 2 * plain_ones > count && plain_ones < count {
            let others = named(self.each.iter().filter(|b| !plain(b))).unwrap_or_default();
            Some(Problem::warning(format!(
                "{plain_ones} of {count} photographs that were looked at stand before {}, but not {others}: {otherwise}",
                self.colour()
            )))
        } else if self.shaded >= PHOTOGRAPHED {
            Some(Problem::note(format!(
                "{}, and {:.1} % nearly, as paper with shades has: {otherwise}",
                self.share(),
                100.0 * self.shaded
            )))
        } else if self.is_plain_by_itself() {
            Some(Problem::warning(format!(
                "each photograph has a plain border, but of its own colour: {otherwise}"
            )))
        } else {
            None
        };
        (Backdrop::Surroundings, problem)
    }

    fn is_plain_by_itself(&self) -> bool {
        self.each.iter().all(|b| b.own >= EACH)
    }

    /// A warning where the borders show something else than the colour that is stated.
    fn doubt(&self, stated: Backdrop) -> Option<Problem> {
        let Backdrop::Color(colour) = stated else { return None };
        let differs = !is_within(self.common, colour, SHADED);
        let found = if self.same < LITTLE {
            format!("the borders of the photographs show something (only {})", self.share())
        } else if differs && self.same >= RENDERED {
            self.share()
        } else {
            return None;
        };
        Some(Problem::warning(format!(
            "the backdrop is stated to be {stated}, but {found}; --backdrop decides"
        )))
    }
}

/// The pixels of a border that the mask lets count; all where it leaves hardly any, as around a thing that is kept.
fn used(evidence: &Evidence, look: &Look, mask: &Option<MaskLook>) -> Vec<[f32; 3]> {
    let meaning = evidence.views[look.view].mask_meaning;
    let is_used = |k: usize| match (mask, meaning) {
        (Some(mask), MaskMeaning::Keep) => mask.border[k],
        (Some(mask), MaskMeaning::Ignore) => !mask.border[k],
        _ => true,
    };
    let some: Vec<[f32; 3]> =
        look.border.iter().enumerate().filter(|(k, _)| is_used(*k)).map(|(_, pixel)| rgb(*pixel)).collect();
    if some.len() >= FEWEST { some } else { look.border.iter().map(|pixel| rgb(*pixel)).collect() }
}

/// Share of a border with this colour. Where whole sides have it, [`RINGING`] beside things does not count.
fn share(border: &[[f32; 3]], colour: [f32; 3]) -> f64 {
    let is_even = share_within(border, SIDE, colour, SAME) >= EACH;
    share_within(border, PIECE, colour, if is_even { RINGING } else { SAME })
}

/// Share of pieces of a border whose median is within so many levels of a colour.
fn share_within(border: &[[f32; 3]], piece: usize, colour: [f32; 3], levels: f32) -> f64 {
    let medians: Vec<[f32; 3]> = border.chunks(piece).map(median_colour).collect();
    let same = medians.iter().filter(|m| is_within(**m, colour, levels)).count();
    same as f64 / medians.len().max(1) as f64
}

/// The first few names, if there are any.
fn named<'a>(borders: impl Iterator<Item = &'a Border>) -> Option<String> {
    let names: Vec<&str> = borders.map(|b| b.name.as_str()).collect();
    (!names.is_empty()).then(|| first_few(names.into_iter()))
}

/// `transparent`, `surroundings` or `#rrggbb`.
impl fmt::Display for Backdrop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Backdrop::Transparent => f.write_str("transparent"),
            Backdrop::Surroundings => f.write_str("surroundings"),
            Backdrop::Color(rgb) => {
                let [r, g, b] = rgb.map(quantize);
                write!(f, "#{r:02x}{g:02x}{b:02x}")
            }
        }
    }
}

/// A text that is no [`Backdrop`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected surroundings, transparent, or a colour such as #ffffff")]
pub struct NoBackdrop;

impl FromStr for Backdrop {
    type Err = NoBackdrop;

    fn from_str(text: &str) -> Result<Self, NoBackdrop> {
        match text.to_ascii_lowercase().as_str() {
            "surroundings" => return Ok(Backdrop::Surroundings),
            "transparent" => return Ok(Backdrop::Transparent),
            "white" => return Ok(Backdrop::Color([1.0; 3])),
            "black" => return Ok(Backdrop::Color([0.0; 3])),
            _ => {}
        }
        let digits = text.strip_prefix('#').unwrap_or(text);
        let is_colour = digits.len() == 6 && digits.bytes().all(|b| b.is_ascii_hexdigit());
        let number = u32::from_str_radix(digits, 16).ok().filter(|_| is_colour).ok_or(NoBackdrop)?;
        Ok(Backdrop::Color([16, 8, 0].map(|shift| (number >> shift & 0xff) as f32 / 255.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_backdrop_is_read_as_it_is_written() {
        for backdrop in [Backdrop::Transparent, Backdrop::Surroundings, Backdrop::Color([1.0, 0.2, 0.0])] {
            assert_eq!(backdrop.to_string().parse(), Ok(backdrop));
        }
        assert_eq!("White".parse(), Ok(Backdrop::Color([1.0; 3])));
        assert_eq!("0000ff".parse(), Ok(Backdrop::Color([0.0, 0.0, 1.0])));
        for wrong in ["", "#fff", "#gggggg", "sky", "+00000f"] {
            assert_eq!(wrong.parse::<Backdrop>(), Err(NoBackdrop), "{wrong}");
        }
    }
}
