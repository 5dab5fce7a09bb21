use super::error::MetricsError;
use super::rgb8::Rgb8;
use super::{masked_psnr, psnr, ssim};
use serde::{Deserialize, Serialize};

/// Names the protocol of every figure of this module; printed and stored next to the figures.
///
/// PSNR from the mean squared error of 8-bit values / 255, SSIM with an 11×11 Gaussian window of σ 1.5 over the places
/// where the window fits, masked PSNR over the pixels of the mask only; each per image, then the mean over images.
pub const PROTOCOL: &str = "srgb8-mean; ssim 11x11 gaussian 1.5 valid";

/// Scores of one image. In JSON an infinite PSNR (equal images) is `null` and a missing score is absent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImageScore {
    /// File name of the truth.
    pub name: String,
    /// Over all pixels [dB]; infinite when the images are equal.
    #[serde(with = "null_is_infinite")]
    pub psnr: f64,
    /// Structural similarity [1]; absent below 11×11 pixels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ssim: Option<f64>,
    /// Over the pixels inside the mask [dB]; absent without a mask or below 64 such pixels.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "null_is_infinite::optional")]
    pub psnr_inside: Option<f64>,
    /// Over the pixels outside the mask [dB]; absent without a mask or below 64 such pixels.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "null_is_infinite::optional")]
    pub psnr_outside: Option<f64>,
}

impl ImageScore {
    /// Scores `render` against `truth`, and apart inside and outside the `mask` coverage when there is one.
    pub fn new(
        name: &str,
        render: Rgb8<'_>,
        truth: Rgb8<'_>,
        mask: Option<&[u8]>,
    ) -> Result<Self, MetricsError> {
        let (psnr_inside, psnr_outside) = match mask {
            Some(coverage) => masked_psnr(render, truth, coverage)?,
            None => (None, None),
        };
        Ok(Self {
            name: name.to_owned(),
            psnr: psnr(render, truth)?,
            ssim: ssim(render, truth)?,
            psnr_inside,
            psnr_outside,
        })
    }
}

/// Scores of a split: the mean over images of each finite score, and the images themselves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// Number of images.
    pub images: usize,
    /// Mean PSNR [dB] over the images that differ from their truth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub psnr: Option<f64>,
    /// Mean structural similarity [1].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ssim: Option<f64>,
    /// Mean PSNR [dB] inside the masks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub psnr_inside: Option<f64>,
    /// Mean PSNR [dB] outside the masks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub psnr_outside: Option<f64>,
    /// Which computation these are figures of, see [`PROTOCOL`].
    pub protocol: String,
    /// One row per image.
    pub per_image: Vec<ImageScore>,
}

impl Scores {
    /// Means over `per_image`; infinite values are left out of the means.
    pub fn new(per_image: Vec<ImageScore>) -> Self {
        let mean = |score: fn(&ImageScore) -> Option<f64>| {
            let finite: Vec<f64> = per_image.iter().filter_map(score).filter(|v| v.is_finite()).collect();
            (!finite.is_empty()).then(|| finite.iter().sum::<f64>() / finite.len() as f64)
        };
        Self {
            images: per_image.len(),
            psnr: mean(|s| Some(s.psnr)),
            ssim: mean(|s| s.ssim),
            psnr_inside: mean(|s| s.psnr_inside),
            psnr_outside: mean(|s| s.psnr_outside),
            protocol: PROTOCOL.to_owned(),
            per_image,
        }
    }
}

/// JSON knows no infinity: `null` stands for it.
mod null_is_infinite {
    use serde::{Deserialize, Deserializer, Serializer};

    pub fn serialize<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        if value.is_finite() { serializer.serialize_f64(*value) } else { serializer.serialize_none() }
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        Ok(Option::deserialize(deserializer)?.unwrap_or(f64::INFINITY))
    }

    pub mod optional {
        use serde::{Deserializer, Serializer};

        pub fn serialize<S: Serializer>(value: &Option<f64>, serializer: S) -> Result<S::Ok, S::Error> {
            super::serialize(&value.unwrap_or(f64::INFINITY), serializer)
        }

        pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
            super::deserialize(deserializer).map(Some)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::examples::{disc, pair};
    use super::*;

    fn score(name: &str, render: &[[u8; 3]], truth: &[[u8; 3]], mask: Option<&[u8]>) -> ImageScore {
        ImageScore::new(name, Rgb8::new(render, 24, 20), Rgb8::new(truth, 24, 20), mask).unwrap()
    }

    #[test]
    fn means_leave_out_infinite_and_missing_scores() {
        let (a, b) = pair(24, 20);
        let rows = vec![
            score("1.png", &a, &b, Some(&disc(24, 20))),
            score("2.png", &b, &b, None),
            score("3.png", &b, &a, None),
        ];
        let (row, inside) = (rows[0].psnr, rows[0].psnr_inside);
        let scores = Scores::new(rows);
        assert_eq!(scores.images, 3);
        assert_eq!(scores.psnr, Some(row));
        assert_eq!(scores.psnr_inside, inside);
        let ssim = scores.per_image[0].ssim.unwrap();
        assert!((scores.ssim.unwrap() - (2.0 * ssim + 1.0) / 3.0).abs() < 1e-6);
    }

    #[test]
    fn json_round_trip_keeps_infinite_and_missing_scores_apart() {
        let (a, b) = pair(24, 20);
        let mask = disc(24, 20);
        let scores = Scores::new(vec![score("same", &a, &a, Some(&mask)), score("no mask", &a, &b, None)]);
        let json = serde_json::to_string(&scores).unwrap();
        assert_eq!(serde_json::from_str::<Scores>(&json).unwrap(), scores);
        let value: serde_json::Value = serde_json::from_str(&json).unwrap();
        assert!(value["per_image"][0]["psnr_inside"].is_null());
        assert!(value["per_image"][1].get("psnr_inside").is_none());
        assert_eq!(value["protocol"], PROTOCOL);
    }

    #[test]
    fn scores_of_no_image_have_no_mean() {
        let scores = Scores::new(Vec::new());
        assert_eq!((scores.images, scores.psnr), (0, None));
    }
}
