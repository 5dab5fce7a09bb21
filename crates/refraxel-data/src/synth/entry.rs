//! What an entry of a `scene.json` says of a body, checked field by field.

use super::medium::{Index, Medium};
use super::scene::{Body, Matter};
use super::shape::Shape;
use super::texture::Texture;
use crate::json::{self, Object};
use crate::{DataError, INDICES, limits};
use refraxel_core::{Vec3, vec3};
use serde::Deserialize;
use serde_json::Value;
use std::path::Path;

const NUMBERS: &str = "finite numbers";
const POSITIVE: &str = "a finite number > 0";
const UNIT: &str = "a vector of length 1";
const SHAPE: &str = "the fields of a known shape";
/// Places along each axis of a body at which an index that varies is looked at.
const PLACES: usize = 9;

/// The body that entry `i` of the list `refractive` describes.
pub(super) fn refractive(path: &Path, i: usize, entry: &Value) -> Result<Body, DataError> {
    let place = format!("refractive[{i}]");
    let object = Object::new(path, &place, entry)?;
    check_numbers(path, &place, entry)?;
    let priority = object.number("priority")?.map_or(i as u32 + 1, |p| p as u32);
    let required = |key: &str| object.number(key)?.ok_or_else(|| object.wrong(key, "a number"));
    let (shape, index, key) = match (entry.get("region"), entry.get("index")) {
        (Some(region), Some(index)) => {
            let index = typed(path, object.key("index"), index, "the fields of a known index")?;
            (typed(path, object.key("region"), region, SHAPE)?, index, "index")
        }
        _ if object.text("shape")? == Some("luneburg") => {
            let center = object.numbers("center", "three numbers")?;
            let center: [f64; 3] = center.ok_or_else(|| object.wrong("center", "three numbers"))?;
            let radius = required("radius")?;
            (Shape::sphere(center, radius), Index::Luneburg { center: center.into(), radius }, "radius")
        }
        _ => (typed(path, place.clone(), entry, SHAPE)?, Index::Constant { ior: required("ior")? }, "ior"),
    };
    check_shape(path, &place, &shape, f64::MIN_POSITIVE)?;
    if let Some(n) = bad_index(&index, &shape) {
        let (path, key) = (path.to_owned(), object.key(key));
        let expected = "an index of refraction from 0.25 to 5 everywhere in the body";
        return Err(DataError::Value { path, key, found: n.to_string(), expected });
    }
    let visible = object.get("visible").map(|v| typed(path, object.key("visible"), v, SHAPE)).transpose()?;
    if let Some(visible) = &visible {
        check_shape(path, &object.key("visible"), visible, f64::MIN_POSITIVE)?;
    }
    let medium = Medium { index, absorption: [0.0; 3] };
    Ok(Body { name: String::new(), shape, matter: Matter::Refractive { medium, priority, visible } })
}

/// The body that entry `i` of the list `opaque` describes.
pub(super) fn opaque(path: &Path, i: usize, entry: &Value) -> Result<Body, DataError> {
    let place = format!("opaque[{i}]");
    check_numbers(path, &place, entry)?;
    let shape = typed(path, place.clone(), entry, SHAPE)?;
    check_shape(path, &place, &shape, 0.0)?; // ground may be flat
    Ok(Body::opaque("opaque", shape, Texture::Plain([0.0; 3])))
}

fn typed<'a, T: Deserialize<'a>>(
    path: &Path,
    key: String,
    value: &'a Value,
    expected: &'static str,
) -> Result<T, DataError> {
    let fault = |e: serde_json::Error| DataError::Value {
        path: path.to_owned(),
        key,
        found: e.to_string(),
        expected,
    };
    T::deserialize(value).map_err(fault)
}

/// Refuses numbers that are none, sizes that are not positive, and directions of another length, by their names.
fn check_numbers(path: &Path, place: &str, value: &Value) -> Result<(), DataError> {
    for (key, value) in value.as_object().into_iter().flatten() {
        let place = format!("{place}.{key}");
        let expect = |fits: bool, expected| {
            if fits { Ok(()) } else { Err(json::wrong(path, place.clone(), value, expected)) }
        };
        match key.as_str() {
            "region" | "index" | "visible" => check_numbers(path, &place, value)?,
            "parts" | "faces" | "waves" => {
                for (i, part) in value.as_array().into_iter().flatten().enumerate() {
                    check_numbers(path, &format!("{place}[{i}]"), part)?;
                }
            }
            "radius" | "sigma" | "major" | "minor" => {
                expect(value.as_f64().is_some_and(|v| v > 0.0), POSITIVE)?
            }
            "axis" | "normal" => expect(is_unit(value), UNIT)?,
            "center" | "min" | "max" | "from" | "to" | "ior" | "peak" | "alpha" | "z_bottom" | "z_top"
            | "bottom" | "top" | "disk" | "rim" | "blend" | "amplitude" | "vector" | "phase" | "level"
            | "offset" | "z" | "vertices" => expect(is_finite(value), NUMBERS)?,
            _ => {}
        }
    }
    Ok(())
}

/// Numbers, or lists of them. A number in JSON is finite.
fn is_finite(value: &Value) -> bool {
    value.is_number() || value.as_array().is_some_and(|list| list.iter().all(is_finite))
}

fn is_unit(value: &Value) -> bool {
    <[f64; 3]>::deserialize(value).is_ok_and(|v| (Vec3::from(v).length() - 1.0).abs() < 1e-3)
}

/// Refuses a shape of too many pieces, and one whose edges are not longer than `least`.
fn check_shape(path: &Path, key: &str, shape: &Shape, least: f64) -> Result<(), DataError> {
    limits::pieces(path, shape.pieces())?;
    let bounds = shape.bounds();
    let is_body = bounds.min.is_finite() && bounds.max.is_finite() && bounds.extent().min_element() >= least;
    if is_body {
        return Ok(());
    }
    let found = format!("a body from {:?} to {:?}", bounds.min.to_array(), bounds.max.to_array());
    let expected = "a body with finite edges > 0";
    Err(DataError::Value { path: path.to_owned(), key: key.to_owned(), found, expected })
}

/// An index that no body has.
fn bad_index(index: &Index, shape: &Shape) -> Option<f64> {
    let is_bad = |n: &f64| !(INDICES[0]..=INDICES[1]).contains(n);
    if let Index::Constant { ior } = index {
        return Some(*ior).filter(is_bad);
    }
    let (bounds, step) = (shape.bounds(), |k: usize| (k as f64 + 0.5) / PLACES as f64);
    let at = |k: usize| {
        let share = vec3(step(k % PLACES), step(k / PLACES % PLACES), step(k / PLACES / PLACES));
        bounds.min + bounds.extent().hadamard(share)
    };
    (0..PLACES.pow(3)).map(at).filter(|x| shape.contains(*x)).map(|x| index.n(x)).find(is_bad)
}
