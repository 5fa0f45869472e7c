//! OpenSfM's `reconstruction.json`: a list of reconstructions, of which the one with the most points is the map.

use std::fmt;
use std::path::Path;

use serde::de::{DeserializeSeed, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, de};

use super::found::{DOWNWARD, Found, camera};
use super::json;
use crate::error::Error;

#[derive(Deserialize)]
struct Shot {
    /// Axis times angle.
    rotation: [f64; 3],
    translation: [f64; 3],
}

#[derive(Deserialize)]
struct Point {
    coordinates: [f64; 3],
}

/// The rotation by the length of `vector` about it.
fn rotation(vector: [f64; 3]) -> [[f64; 3]; 3] {
    let angle = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
    let axis = if angle > 0.0 { vector.map(|x| x / angle) } else { [0.0; 3] };
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    let [x, y, z] = axis;
    let cross = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
    std::array::from_fn(|row| {
        std::array::from_fn(|c| {
            let unit = if row == c { cos } else { 0.0 };
            unit + sin * cross[row][c] + (1.0 - cos) * axis[row] * axis[c]
        })
    })
}

/// Values of an object, in the order of the file.
struct Values<T, F>(F, std::marker::PhantomData<T>);

impl<'de, T: Deserialize<'de>, F: FnMut(T) -> Result<(), String>> DeserializeSeed<'de>
    for Values<T, F>
{
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, json: D) -> Result<(), D::Error> {
        json.deserialize_map(self)
    }
}

impl<'de, T: Deserialize<'de>, F: FnMut(T) -> Result<(), String>> Visitor<'de> for Values<T, F> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(mut self, mut object: A) -> Result<(), A::Error> {
        while object.next_key::<IgnoredAny>()?.is_some() {
            (self.0)(object.next_value()?).map_err(de::Error::custom)?;
        }
        Ok(())
    }
}

/// One reconstruction.
struct Reconstruction(Found);

impl<'de> Deserialize<'de> for Reconstruction {
    fn deserialize<D: Deserializer<'de>>(json: D) -> Result<Self, D::Error> {
        struct Fields;
        impl<'de> Visitor<'de> for Fields {
            type Value = Found;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a reconstruction of OpenSfM")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut object: A) -> Result<Found, A::Error> {
                let mut found = Found::default();
                while let Some(name) = object.next_key::<String>()? {
                    match &*name {
                        "shots" => object.next_value_seed(Values(
                            |shot: Shot| {
                                let pose = (rotation(shot.rotation), shot.translation);
                                let (center, up) = camera(&pose.0, &pose.1, DOWNWARD)
                                    .ok_or("a pose that is not finite")?;
                                found.cameras.push(center);
                                found.up.push(up);
                                Ok(())
                            },
                            std::marker::PhantomData,
                        ))?,
                        "points" => object.next_value_seed(Values(
                            |point: Point| {
                                if point.coordinates.iter().any(|x| !x.is_finite()) {
                                    return Err("coordinates that are not finite".to_owned());
                                }
                                found.positions.push(point.coordinates);
                                Ok(())
                            },
                            std::marker::PhantomData,
                        ))?,
                        _ => drop(object.next_value::<IgnoredAny>()?),
                    }
                }
                Ok(found)
            }
        }
        json.deserialize_map(Fields).map(Self)
    }
}

/// All reconstructions of a file: the largest, and how many there are.
struct All;

impl<'de> DeserializeSeed<'de> for All {
    type Value = (Found, usize);

    fn deserialize<D: Deserializer<'de>>(self, json: D) -> Result<Self::Value, D::Error> {
        json.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for All {
    type Value = (Found, usize);

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list of reconstructions, as OpenSfM writes it")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Self::Value, A::Error> {
        let (mut largest, mut n) = (Found::default(), 0);
        while let Some(Reconstruction(found)) = list.next_element()? {
            n += 1;
            if n == 1 || found.positions.len() > largest.positions.len() {
                largest = found;
            }
        }
        Ok((largest, n))
    }
}

/// Reads the largest reconstruction.
///
/// # Errors
/// When the file is not OpenSfM's, or a number is not finite.
pub fn read(path: &Path) -> Result<Found, Error> {
    let (mut found, n) = json::read(path, All)?;
    if n > 1 {
        let points = found.positions.len();
        found.notes.push(format!("read, the largest of {n} reconstructions ({points} points)"));
    }
    Ok(found)
}
