//! Intrinsics keys of `transforms.json`.

use crate::DataError;
use crate::formats::lens::opencv;
use crate::json::Object;
use crate::parsed::{FieldOfView, Focal, Intrinsics};
use refraxel_core::Lens;
use std::f64::consts::PI;

/// Intrinsics of a frame, its own keys before those of its file, and a sentence when a focal length and the field of view
/// along the same axis disagree by more than 0.1 % (the focal length wins: it is the calibration, the angle a convenience).
pub(super) fn intrinsics(frame: &Object) -> Result<(Intrinsics, Option<String>), DataError> {
    refuse_unsupported(frame)?;
    let size = pair(frame, "w", "h")?;
    let lens = lens(frame)?;
    if lens == Lens::Equirectangular {
        return Ok((Intrinsics { size, focal: Focal::Panorama, center: None, lens }, None));
    }
    let own = frame.alone();
    let (angles, pixels) = match (field_of_view(&own)?, focal(&own)?) {
        (None, None) => (field_of_view(frame)?, focal(frame)?),
        own => own,
    };
    let focal = match (pixels, angles) {
        (Some(pixels), _) => Focal::Pixels(pixels),
        (None, Some(angles)) => Focal::Angles(angles),
        (None, None) => return Err(frame.wrong("fl_x", "fl_x [pixel] or camera_angle_x [radian]")),
    };
    let intrinsics = Intrinsics { size, focal, center: pair(frame, "cx", "cy")?, lens };
    Ok((intrinsics, disagreement(size, pixels, angles)))
}

/// Both numbers or neither.
fn pair(frame: &Object, x: &str, y: &str) -> Result<Option<[f64; 2]>, DataError> {
    match (frame.number(x)?, frame.number(y)?) {
        (Some(a), Some(b)) => {
            let impossible = x == "w" && !(a >= 1.0 && b >= 1.0);
            if impossible {
                Err(frame.wrong(x, "an image size of at least 1 pixel"))
            } else {
                Ok(Some([a, b]))
            }
        }
        (None, None) => Ok(None),
        (Some(_), None) => Err(frame.wrong(y, "a number, because its partner is given")),
        (None, Some(_)) => Err(frame.wrong(x, "a number, because its partner is given")),
    }
}

/// `fl_x`, `fl_y`; one may be missing where pixels are square.
fn focal(frame: &Object) -> Result<Option<[f64; 2]>, DataError> {
    let (x, y) = (frame.number("fl_x")?, frame.number("fl_y")?);
    for (key, value) in [("fl_x", x), ("fl_y", y)] {
        if value.is_some_and(|f| f <= 0.0) {
            return Err(frame.wrong(key, "a focal length > 0 [pixel]"));
        }
    }
    Ok(x.or(y).map(|f| [x.unwrap_or(f), y.unwrap_or(f)]))
}

/// Full fields of view [rad] from `x_fov`, `y_fov` [degree] or `camera_angle_x`, `camera_angle_y` [rad].
fn field_of_view(frame: &Object) -> Result<Option<FieldOfView>, DataError> {
    let angle = |degrees: &str, radians: &str| -> Result<Option<f64>, DataError> {
        let (key, value) = match frame.number(degrees)? {
            Some(value) => (degrees, Some(value.to_radians())),
            None => (radians, frame.number(radians)?),
        };
        if value.is_some_and(|a| a <= 0.0 || a >= PI) {
            let expected = match key == degrees {
                true => "a full field of view between 0 and 180 degrees",
                false => {
                    "a full field of view between 0 and 3.1416 radians (degrees are called x_fov and y_fov)"
                }
            };
            return Err(frame.wrong(key, expected));
        }
        Ok(value)
    };
    Ok(match (angle("x_fov", "camera_angle_x")?, angle("y_fov", "camera_angle_y")?) {
        (Some(x), Some(y)) => Some(FieldOfView::Both([x, y])),
        (Some(x), None) => Some(FieldOfView::X(x)),
        (None, y) => y.map(FieldOfView::Y),
    })
}

fn disagreement(
    size: Option<[f64; 2]>,
    pixels: Option<[f64; 2]>,
    angles: Option<FieldOfView>,
) -> Option<String> {
    let (size, pixels, angles) = (size?, pixels?, angles?);
    let (axis, key) = if matches!(angles, FieldOfView::Y(_)) { (1, "fl_y") } else { (0, "fl_x") };
    let [stated, from_angle] = [pixels, angles.focal(size)].map(|focal| focal[axis]);
    ((from_angle / stated - 1.0).abs() > 1e-3).then(|| {
        format!("{key} is {stated:.3}, but the field of view says {from_angle:.3} [pixel]; {key} is used")
    })
}

/// Modes whose rays would be wrong if they were read as something else.
fn refuse_unsupported(frame: &Object) -> Result<(), DataError> {
    let modes = ["orthographic", "equirectangular"]; // instant-ngp's equirectangular is equal-area, not the usual one
    let mode = modes.into_iter().find(|key| frame.flag(key).unwrap_or(true));
    let polynomial = (0..5).map(|i| format!("ftheta_p{i}")).find(|key| frame.get(key).is_some());
    match mode.map(str::to_owned).or(polynomial) {
        Some(key) => {
            let (path, model) = (frame.path().to_owned(), format!("{key} (instant-ngp)"));
            Err(DataError::UnsupportedCamera { path, key: frame.key(&key), model })
        }
        None => Ok(()),
    }
}

/// `camera_model` with k1..k6, p1, p2 or `distortion_params`; instant-ngp's `is_fisheye` and `latlong`.
fn lens(frame: &Object) -> Result<Lens, DataError> {
    let stated = frame.text("camera_model")?.map(str::to_ascii_uppercase);
    let model = match stated.as_deref() {
        None if frame.flag("is_fisheye")? => "OPENCV_FISHEYE",
        None if frame.flag("latlong")? => "EQUIRECTANGULAR",
        None => "OPENCV",
        Some(model) => model,
    };
    let Coefficients { k: [k1, k2, k3, k4, k5, k6], p } = coefficients(frame)?;
    if model != "FULL_OPENCV" && (k5 != 0.0 || k6 != 0.0) {
        let key = frame.key(if k5 != 0.0 { "k5" } else { "k6" });
        let advice = "k5 and k6 belong to the rational model, where k4 means something else; if it is meant, state \
                      \"camera_model\": \"FULL_OPENCV\"";
        return Err(DataError::UnsupportedFeature { path: frame.path().to_owned(), key, advice });
    }
    let k = [k1, k2, k3, k4];
    Ok(match model {
        "OPENCV_FISHEYE" | "FISHEYE" | "SIMPLE_FISHEYE" | "SIMPLE_RADIAL_FISHEYE" | "RADIAL_FISHEYE" => {
            Lens::Fisheye { k }
        }
        "EQUIRECTANGULAR" => Lens::Equirectangular,
        "FULL_OPENCV" => Lens::FullOpenCv { k: [k1, k2, k3, k4, k5, k6], p },
        "SIMPLE_PINHOLE" | "PINHOLE" | "PERSPECTIVE" | "SIMPLE_RADIAL" | "RADIAL" | "OPENCV" => opencv(k, p),
        _ => {
            let (path, model) = (frame.path().to_owned(), model.to_owned());
            return Err(DataError::UnsupportedCamera { path, key: frame.key("camera_model"), model });
        }
    })
}

struct Coefficients {
    k: [f64; 6],
    p: [f64; 2],
}

/// `distortion_params` (nerfstudio: k1 k2 k3 k4 p1 p2; 4 numbers are k1..k4) or the single keys.
fn coefficients(frame: &Object) -> Result<Coefficients, DataError> {
    const EXPECTED: &str = "4 or 6 finite numbers: k1 k2 k3 k4 [p1 p2]";
    if let Some(list) = frame.get("distortion_params") {
        let [k1, k2, k3, k4, p1, p2] = match list.as_array().map(Vec::len) {
            Some(4) => {
                let [a, b, c, d] = frame.numbers::<4>("distortion_params", EXPECTED)?.unwrap_or_default();
                [a, b, c, d, 0.0, 0.0]
            }
            _ => frame.numbers::<6>("distortion_params", EXPECTED)?.unwrap_or_default(),
        };
        return Ok(Coefficients { k: [k1, k2, k3, k4, 0.0, 0.0], p: [p1, p2] });
    }
    let number = |key: &str| frame.number(key).map(Option::unwrap_or_default);
    let k = [number("k1")?, number("k2")?, number("k3")?, number("k4")?, number("k5")?, number("k6")?];
    Ok(Coefficients { k, p: [number("p1")?, number("p2")?] })
}
