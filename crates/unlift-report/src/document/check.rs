//! The rules of `audit.json` that its types cannot express.

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::document::{Document, Error, Row, SCHEMA};

impl Document {
    /// Checks the rules of the format: the schema, one row per combination, finite numbers,
    /// percentages between 0 and 100, the same thresholds in every map of a row, lost points that add up.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] with the place of the first broken rule, or [`Error::Schema`].
    pub fn check(&self) -> Result<(), Error> {
        if self.schema != SCHEMA {
            return Err(Error::Schema { expected: SCHEMA, found: self.schema.into() });
        }
        // Parts of a row are not written.
        let written =
            self.results.iter().map(|row| Row { parts: Default::default(), ..row.clone() });
        all_finite("results", &written.collect::<Vec<_>>())?;
        all_finite("gates", &self.gates)?;
        all_finite("break_even", &self.break_even)?;
        all_finite("images", &self.images)?;
        all_finite("tiles", &self.tiles)?;
        all_finite("localization", &self.localization)?;
        finite("input", &self.input)?;
        finite("run", &self.run)?;
        for (field, length) in [
            ("scale_m_per_unit", self.input.scale_m_per_unit),
            ("unit_in_map_units", self.input.unit_in_map_units),
        ] {
            if let Some(length) = length.filter(|length| *length <= 0.0) {
                return invalid(format!("input.{field}"), "a number above zero", length);
            }
        }
        for (i, row) in self.results.iter().enumerate() {
            let place = format!("results[{i}]");
            check_row(&place, row)?;
            let is_same = |other: &Row| {
                other.is_same_cell(row)
                    && other.inlier_ratio == row.inlier_ratio
                    && other.k == row.k
            };
            if let Some(j) = self.results[..i].iter().position(is_same) {
                let found = format!("the combination of results[{j}] again");
                return invalid(place, "a combination of its own", found);
            }
        }
        for (i, gate) in self.gates.iter().enumerate() {
            if gate.passed && (gate.found_percent.is_none() || gate.reason.is_some()) {
                let expected = "false where a figure is not known";
                return invalid(format!("gates[{i}].passed"), expected, true);
            }
        }
        for (i, missing) in self.not_audited.iter().enumerate() {
            let has_rows = |row: &Row| row.scheme == missing.scheme;
            if missing.neighbors.is_none() && self.results.iter().any(has_rows) {
                let found = format!("{}, which has rows", missing.scheme);
                let expected = "a scheme without rows in results";
                return invalid(format!("not_audited[{i}].scheme"), expected, found);
            }
        }
        for (i, image) in self.images.iter().enumerate() {
            self.check_rows(format!("images[{i}].rows"), image.rows.len(), true)?;
        }
        for (i, tile) in self.tiles.iter().enumerate() {
            let n = tile.recovered_percent.len();
            self.check_rows(format!("tiles[{i}].recovered_percent"), n, false)?;
        }
        self.check_rows("run.seconds.rows".to_owned(), self.run.seconds.rows.len(), true)?;
        let whole = serde_json::to_value(self)?;
        for name in ["results", "break_even", "images", "tiles", "localization"] {
            whole.get(name).map_or(Ok(()), |part| shares(name, part, None))?;
        }
        Ok(())
    }

    /// Checks that a list has one entry per row of the results.
    fn check_rows(&self, place: String, n: usize, may_be_empty: bool) -> Result<(), Error> {
        let expected = self.results.len();
        if n == expected || (n == 0 && may_be_empty) {
            return Ok(());
        }
        invalid(place, format!("{expected} rows, as in results"), n)
    }
}

fn all_finite<T: Serialize + DeserializeOwned + PartialEq>(
    name: &str,
    parts: &[T],
) -> Result<(), Error> {
    parts.iter().enumerate().try_for_each(|(i, part)| finite(&format!("{name}[{i}]"), part))
}

/// Checks that all numbers of a part are finite: JSON has neither NaN nor infinity, so that what is read from its text differs from it.
fn finite<T: Serialize + DeserializeOwned + PartialEq>(place: &str, part: &T) -> Result<(), Error> {
    match serde_json::from_value::<T>(serde_json::to_value(part)?) {
        Ok(read) if read == *part => Ok(()),
        _ => invalid(place, "finite numbers", "NaN or infinity"),
    }
}

fn check_row(place: &str, row: &Row) -> Result<(), Error> {
    let thresholds: Vec<&String> = row.recovered_percent.keys().collect();
    let alone = row.records_alone_percent.as_ref().map(|by| by.keys().collect());
    let by = row.records_alone_by.as_ref().map(|by| by.keys().collect());
    let has_alone = alone.is_some() || by.is_some();
    let listed = |keys: &[&String]| keys.iter().copied().cloned().collect::<Vec<_>>().join(", ");
    for (field, keys, is_needed) in [
        ("blind_percent", Some(row.blind_percent.keys().collect::<Vec<_>>()), true),
        ("records_alone_percent", alone, has_alone),
        ("records_alone_by", by, has_alone),
    ] {
        if is_needed && keys.as_ref() != Some(&thresholds) {
            let found = keys.map_or_else(|| "nothing".to_owned(), |keys| listed(&keys));
            let expected = format!("the thresholds {}", listed(&thresholds));
            return invalid(format!("{place}.{field}"), expected, found);
        }
    }
    if let (Some(sure), Some(reason)) = (row.sure_percent, &row.sure_unknown) {
        let expected = format!("null, as sure_unknown says {reason:?}");
        return invalid(format!("{place}.sure_percent"), expected, sure);
    }
    let lost: usize = row.lost.values().sum();
    // Earlier versions wrote rounded means over repeats, whose sum may differ.
    if row.repeats == 1 && lost != row.n_lost {
        return invalid(format!("{place}.lost"), format!("a sum of {}", row.n_lost), lost);
    }
    if row.n_lost > row.n_points {
        return invalid(format!("{place}.n_lost"), format!("at most {}", row.n_points), row.n_lost);
    }
    Ok(())
}

/// Checks every number under a name of a percentage or a ratio: `highest` is its largest value. Figures of others, in `metrics`,
/// have any range.
fn shares(place: &str, value: &Value, highest: Option<f64>) -> Result<(), Error> {
    match (value, highest) {
        (Value::Object(fields), _) => fields.iter().try_for_each(|(name, field)| match highest {
            _ if name == "metrics" => Ok(()),
            Some(_) => shares(&format!("{place}[{name:?}]"), field, highest),
            None => shares(&format!("{place}.{name}"), field, highest_of(name)),
        }),
        (Value::Array(items), _) => {
            let mut items = items.iter().enumerate();
            items.try_for_each(|(i, item)| shares(&format!("{place}[{i}]"), item, highest))
        }
        (Value::Number(number), Some(highest)) => match number.as_f64() {
            Some(value) if !(0.0..=highest).contains(&value) => {
                invalid(place, format!("a number from 0 to {highest}"), value)
            }
            _ => Ok(()),
        },
        _ => Ok(()),
    }
}

fn highest_of(name: &str) -> Option<f64> {
    match name {
        "inlier_ratio" | "predicted" | "observed" => Some(1.0),
        _ if name.ends_with("_percent") => Some(100.0),
        _ => None,
    }
}

fn invalid(
    place: impl Into<String>,
    expected: impl Into<String>,
    found: impl ToString,
) -> Result<(), Error> {
    Err(Error::Invalid { place: place.into(), expected: expected.into(), found: found.to_string() })
}
