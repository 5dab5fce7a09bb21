//! The calibration of a sensor. Its formulas are those of the manual of Metashape (appendix "camera models").
//!
//! Pixel centres are at +0.5, as inside. P1 stands where OpenCV has p2, and P2 where it has p1: x' has P1 (r² + 2x²) + 2 P2 x y.

use super::element::{Element, child};
use crate::formats::lens::{fisheye, opencv};
use crate::parsed::{Focal, Intrinsics};
use crate::{DataError, Problem};
use refraxel_core::Lens;
use roxmltree::Node;

/// A shear that moves no pixel by more is left out [pixel].
const NEGLIGIBLE_SHEAR: f64 = 0.5;

/// The intrinsics of a `<sensor>`, and what is to be said of them.
pub(super) fn intrinsics(sensor: &Element) -> Result<(Intrinsics, Vec<Problem>), DataError> {
    let calibration = calibration(sensor.node);
    let resolution =
        calibration.and_then(|c| child(c, "resolution")).or_else(|| child(sensor.node, "resolution"));
    let resolution =
        resolution.ok_or_else(|| sensor.wrong("resolution", "missing", "width and height [pixel]"))?;
    let size = [sensor.size(resolution, "width")?, sensor.size(resolution, "height")?];
    let of = |node: Node| node.attribute("type").map(str::to_owned);
    let kind = calibration.and_then(of).or_else(|| of(sensor.node)).unwrap_or_else(|| "frame".to_owned());
    if kind == "spherical" {
        let (focal, lens) = (Focal::Panorama, Lens::Equirectangular);
        return Ok((Intrinsics { size: Some(size), focal, center: None, lens }, Vec::new()));
    }
    let calibration = calibration.ok_or_else(|| {
        sensor.wrong(
            "calibration",
            "missing",
            "an element <calibration>; export the cameras after the alignment",
        )
    })?;
    let calibration = Element { node: calibration, ..*sensor };
    refuse_moving(sensor)?;
    let lens = lens(&calibration, &kind)?;
    let (focal, center) = projection(&calibration, size)?;
    let shear = calibration.number("b2")? * 0.5 * size[1] / focal[1];
    if shear.abs() > NEGLIGIBLE_SHEAR {
        let advice = "skewed pixels are not modelled; optimise the cameras again without B2";
        return Err(calibration.unsupported("b2", advice));
    }
    let left_out = (shear != 0.0).then(|| {
        let (file, place) = (sensor.path.display(), sensor.place);
        Problem::note(format!(
            "{file}: {place}: the shear b2 is left out; it moves pixels by at most {:.2}",
            shear.abs()
        ))
    });
    let focal = Focal::Pixels(focal);
    let problems = left_out.into_iter().chain(unaligned(&calibration)).collect();
    Ok((Intrinsics { size: Some(size), focal, center: Some(center), lens }, problems))
}

/// A warning about a calibration from before the alignment.
fn unaligned(calibration: &Element) -> Option<Problem> {
    let is_initial = calibration.node.attribute("class") == Some("initial");
    let (file, place) = (calibration.path.display(), calibration.place);
    is_initial.then(|| {
        Problem::warning(format!(
            "{file}: {place} has no calibration of the class adjusted: the one that the alignment began with is used; if the camera was not \
             calibrated before, optimise the cameras and export them again"
        ))
    })
}

/// The calibration that the alignment found, else the one it began with.
fn calibration<'a>(sensor: Node<'a, 'a>) -> Option<Node<'a, 'a>> {
    let all = || sensor.children().filter(|c| c.has_tag_name("calibration"));
    all().find(|c| c.attribute("class") == Some("adjusted")).or_else(|| all().next())
}

/// Focal lengths and principal point [pixel]: f, b1, and cx, cy from the middle of the picture; or fx, fy, and cx, cy from its
/// corner, as PhotoScan had them.
fn projection(calibration: &Element, [w, h]: [f64; 2]) -> Result<([f64; 2], [f64; 2]), DataError> {
    const EXPECTED: &str = "a focal length > 0 [pixel]";
    let at = [calibration.number("cx")?, calibration.number("cy")?];
    let positive = |name: &str| {
        let found = calibration.numbers::<1>(name, EXPECTED)?.filter(|[f]| *f > 0.0);
        found.map(|[f]| f).ok_or_else(|| calibration.wrong(name, "missing or not positive", EXPECTED))
    };
    if child(calibration.node, "f").is_none() && child(calibration.node, "fx").is_some() {
        return Ok(([positive("fx")?, positive("fy")?], at));
    }
    let f = positive("f")?;
    Ok(([f + calibration.number("b1")?, f], [0.5 * w + at[0], 0.5 * h + at[1]]))
}

fn lens(calibration: &Element, kind: &str) -> Result<Lens, DataError> {
    let number = |name: &str| calibration.number(name);
    if number("p3")? != 0.0 || number("p4")? != 0.0 {
        let advice = "it would change rays; optimise the cameras again without P3 and P4";
        return Err(calibration.unsupported("p3, p4", advice));
    }
    let k = [number("k1")?, number("k2")?, number("k3")?, number("k4")?];
    let p = [number("p2")?, number("p1")?];
    match kind {
        "frame" => Ok(opencv(k, p)),
        // The angle from the axis takes the place of the radius; the rest is the same.
        "fisheye" | "equidistant_fisheye" => Ok(fisheye(k, p)),
        _ => {
            let (path, key) = (calibration.path.to_owned(), format!("{}: type", calibration.place));
            Err(DataError::UnsupportedCamera { path, key, model: format!("{kind} (Metashape)") })
        }
    }
}

/// Rows that were exposed at different times have different poses.
fn refuse_moving(sensor: &Element) -> Result<(), DataError> {
    let compensates = |node: Node| {
        let text = node.text().unwrap_or_default().trim();
        node.has_tag_name("rolling_shutter") && !matches!(text, "" | "0" | "false" | "disabled")
    };
    match sensor.node.children().any(compensates) {
        true => {
            Err(sensor.unsupported("rolling_shutter", "align the photographs again without its compensation"))
        }
        false => Ok(()),
    }
}
