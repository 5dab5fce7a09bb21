//! The JSON of reconstructions, whose points take most of the file and little of the memory.

use crate::{DataError, json, limits};
use refraxel_core::Vec3;
use serde::de::{IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::{Map, Value};
use std::fmt::{self, Formatter};
use std::path::Path;

/// One connected set of photographs.
#[derive(Deserialize)]
pub(super) struct Reconstruction {
    pub cameras: Map<String, Value>,
    pub shots: Map<String, Value>,
    #[serde(default)]
    pub points: Points,
    /// Where on the earth the origin is.
    #[serde(default)]
    pub reference_lla: Value,
}

/// All reconstructions of a file. What is not points is counted before it takes memory.
pub(super) fn parse(path: &Path) -> Result<Vec<Reconstruction>, DataError> {
    #[derive(Deserialize)]
    struct Sizes {
        cameras: Count,
        shots: Count,
        #[serde(default)]
        reference_lla: Count,
    }
    let text = json::plain_text(path, limits::RECONSTRUCTION_BYTES)?;
    let sizes: Vec<Sizes> = json::parsed(path, &text)?;
    let count = sizes.iter().map(|s| s.cameras.0 + s.shots.0 + s.reference_lla.0).sum();
    limits::json(path, count, 0)?;
    json::parsed(path, &text)
}

/// Positions of all finite points of `{"1": {"coordinates": [x, y, z], …}, …}`.
#[derive(Default)]
pub(super) struct Points(pub Vec<Vec3<f64>>);

impl<'de> Deserialize<'de> for Points {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct All;
        impl<'de> Visitor<'de> for All {
            type Value = Points;

            fn expecting(&self, f: &mut Formatter) -> fmt::Result {
                f.write_str("points by their ids")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Points, A::Error> {
                #[derive(Deserialize)]
                struct Point {
                    coordinates: [Option<f64>; 3],
                }
                let mut points = Vec::new();
                while let Some((IgnoredAny, Point { coordinates })) = map.next_entry()? {
                    let [x, y, z] = coordinates.map(|c| c.unwrap_or(f64::NAN));
                    points.extend(Some(Vec3::new(x, y, z)).filter(|p| p.is_finite()));
                }
                Ok(Points(points))
            }
        }
        deserializer.deserialize_map(All)
    }
}

/// How many values some JSON has.
#[derive(Default)]
struct Count(usize);

impl<'de> Deserialize<'de> for Count {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Any;
        impl<'de> Visitor<'de> for Any {
            type Value = Count;

            fn expecting(&self, f: &mut Formatter) -> fmt::Result {
                f.write_str("a value")
            }

            fn visit_unit<E>(self) -> Result<Count, E> {
                Ok(Count(1))
            }

            fn visit_bool<E>(self, _: bool) -> Result<Count, E> {
                Ok(Count(1))
            }

            fn visit_i64<E>(self, _: i64) -> Result<Count, E> {
                Ok(Count(1))
            }

            fn visit_u64<E>(self, _: u64) -> Result<Count, E> {
                Ok(Count(1))
            }

            fn visit_f64<E>(self, _: f64) -> Result<Count, E> {
                Ok(Count(1))
            }

            fn visit_str<E>(self, _: &str) -> Result<Count, E> {
                Ok(Count(1))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Count, A::Error> {
                let mut count = 1;
                while let Some(Count(n)) = list.next_element()? {
                    count += n;
                }
                Ok(Count(count))
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Count, A::Error> {
                let mut count = 1;
                while let Some((IgnoredAny, Count(n))) = map.next_entry()? {
                    count += n;
                }
                Ok(Count(count))
            }
        }
        deserializer.deserialize_any(Any)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_do_not_count_and_what_else_is_too_much_is_refused() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let read = |shots: &str, points: &str| {
            let text = format!(r#"[{{"cameras": {{}}, "shots": {shots}, "points": {{{points}}}}}]"#);
            std::fs::write(file.path(), text).unwrap();
            parse(file.path())
        };
        let many =
            (0..=limits::JSON_OBJECTS).map(|i| format!(r#""{i}":{{"coordinates":[0,NaN,{}]}}"#, i % 2));
        let many = many.collect::<Vec<_>>().join(",").replace("NaN,1", "1,1");
        assert_eq!(read("{}", &many).unwrap()[0].points.0.len(), limits::JSON_OBJECTS / 2);
        let list = format!(r#"{{"a": [{}1]}}"#, "1,".repeat(limits::JSON_VALUES));
        let refused = read(&list, "").err().unwrap().to_string();
        assert!(refused.contains("the number of values is 5000"), "{refused}");
        assert!(read("{}", r#""1": 3"#).is_err());
    }
}
