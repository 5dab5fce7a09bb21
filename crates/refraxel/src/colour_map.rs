//! Perceptually uniform colour maps for scalar images.

use crate::canvas::Colour;
use refraxel_data::quantize;

/// A map from [0, 1] to colours in which equal steps look about equal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColourMap {
    /// Black over red to pale yellow: for errors, where zero is black.
    Inferno,
    /// Violet over green to yellow: for depth, opacity and index.
    Viridis,
    /// Blue over white to red: for differences, where zero is in the middle.
    Signed,
    /// White to blue: for the background of lines.
    Tint,
}

/// Corners of [`ColourMap::Signed`] and [`ColourMap::Tint`], evenly spaced: Okabe & Ito 2008, blue and vermilion.
const SIGNED: &[Colour] = &[[0, 114, 178], [255; 3], [213, 94, 0]];
const TINT: &[Colour] = &[[255; 3], [150, 196, 226]];

impl ColourMap {
    /// Colour of `value`; values outside [0, 1] get the colour of the nearer end, NaN is grey.
    ///
    /// Sixth-degree fit by M. Zucker (2018, public domain) of the maps of S. van der Walt and N. Smith (2015);
    /// within 6 grey levels of their tables.
    pub fn at(self, value: f32) -> Colour {
        if value.is_nan() {
            return [128; 3];
        }
        let t = value.clamp(0.0, 1.0);
        let c = match self {
            Self::Inferno => INFERNO,
            Self::Viridis => VIRIDIS,
            Self::Signed => return between(SIGNED, t),
            Self::Tint => return between(TINT, t),
        };
        std::array::from_fn(|k| {
            let level = c.iter().rev().fold(0.0, |sum, c| sum * t + c[k]);
            quantize(level)
        })
    }
}

/// The colour at `t` between evenly spaced corners.
fn between(corners: &[Colour], t: f32) -> Colour {
    let last = corners.len() - 1;
    let k = ((t * last as f32) as usize).min(last - 1);
    let (a, b, f) = (corners[k], corners[k + 1], t * last as f32 - k as f32);
    std::array::from_fn(|c| (f32::from(a[c]) + (f32::from(b[c]) - f32::from(a[c])) * f).round() as u8)
}

/// Coefficients of the powers of t, constant first, for red, green and blue.
const INFERNO: &[[f32; 3]; 7] = &[
    [0.000_218_94, 0.001_651, -0.019_480_9],
    [0.106_513_4, 0.563_956_4, 3.932_712_4],
    [11.602_493, -3.972_854, -15.942_394],
    [-41.703_996, 17.436_4, 44.354_145],
    [77.162_94, -33.402_36, -81.807_31],
    [-71.319_43, 32.626_064, 73.209_52],
    [25.131_126, -12.242_669, -23.070_325],
];
const VIRIDIS: &[[f32; 3]; 7] = &[
    [0.277_727_3, 0.005_407_3, 0.334_099_8],
    [0.105_093, 1.404_613_5, 1.384_590_2],
    [-0.330_861_8, 0.214_847_6, 0.095_095_2],
    [-4.634_23, -5.799_101, -19.332_441],
    [6.228_27, 14.179_933, 56.690_55],
    [4.776_385, -13.745_145, -65.353_03],
    [-5.435_456, 4.645_852_6, 26.312_435],
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Colours of the original tables at 0, 1/4, 1/2, 3/4 and 1.
    #[test]
    fn maps_stay_near_their_tables() {
        let inferno = [[0, 0, 4], [87, 16, 110], [188, 55, 84], [249, 142, 9], [252, 255, 164]];
        let viridis = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
        for (map, table) in [(ColourMap::Inferno, inferno), (ColourMap::Viridis, viridis)] {
            for (k, want) in table.iter().enumerate() {
                let got = map.at(k as f32 / 4.0);
                let off = (0..3).map(|c| got[c].abs_diff(want[c])).max();
                assert!(off <= Some(6), "{map:?} at {k}/4: {got:?} against {want:?}");
            }
        }
    }

    #[test]
    fn lightness_grows() {
        let lightness =
            |c: Colour| 0.2126 * f32::from(c[0]) + 0.7152 * f32::from(c[1]) + 0.0722 * f32::from(c[2]);
        for map in [ColourMap::Inferno, ColourMap::Viridis] {
            for k in 0..16 {
                let (low, high) = (map.at(k as f32 / 16.0), map.at((k + 1) as f32 / 16.0));
                assert!(lightness(low) < lightness(high), "{map:?} at {k}/16");
            }
        }
    }

    #[test]
    fn differences_of_nothing_are_white() {
        assert_eq!((ColourMap::Signed.at(0.5), ColourMap::Tint.at(0.0)), ([255; 3], [255; 3]));
        assert_eq!((ColourMap::Signed.at(0.0), ColourMap::Signed.at(1.0)), ([0, 114, 178], [213, 94, 0]));
    }

    #[test]
    fn values_outside_take_the_ends_and_nan_is_grey() {
        assert_eq!(ColourMap::Viridis.at(-3.0), ColourMap::Viridis.at(0.0));
        assert_eq!(ColourMap::Viridis.at(f32::INFINITY), ColourMap::Viridis.at(1.0));
        assert_eq!(ColourMap::Inferno.at(f32::NAN), [128; 3]);
    }
}
