//! The rules of `audit.json` that its types cannot express.

use serde_json::Value;

use crate::Error;
use crate::document::{Document, Row, SCHEMA};

impl Document {
    /// Checks the rules of the format: the schema, one row per combination, finite numbers,
    /// percentages between 0 and 100, the same thresholds in every map of a row, lost points that
    /// add up.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] with the place of the first broken rule, or [`Error::Schema`].
    pub fn check(&self) -> Result<(), Error> {
        if self.schema != SCHEMA {
            return Err(Error::Schema { expected: SCHEMA, found: self.schema.into() });
        }
        for (field, length) in [
            ("scale_m_per_unit", self.input.scale_m_per_unit),
            ("unit_in_map_units", self.input.unit_in_map_units),
        ] {
            if let Some(length) = length.filter(|length| !(length.is_finite() && *length > 0.0)) {
                return invalid(format!("input.{field}"), "a number above zero", length);
            }
        }
        for (i, row) in self.results.iter().enumerate() {
            let place = format!("results[{i}]");
            check_row(&place, row)?;
            if let Some(j) = self.results[..i].iter().position(|other| same_key(other, row)) {
                let found = format!("the combination of results[{j}] again");
                return invalid(place, "a combination of its own", found);
            }
        }
        for (i, gate) in self.gates.iter().enumerate() {
            let found = gate.found_percent.into_iter().chain(gate.highest_percent);
            let mut values = found.chain([gate.bound_percent]);
            if let Some(value) = values.find(|value| !value.is_finite()) {
                return invalid(format!("gates[{i}]"), "finite numbers", value);
            }
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
        let rows = |place: String, n: usize, may_be_empty: bool| {
            let expected = self.results.len();
            if n == expected || (n == 0 && may_be_empty) {
                return Ok(());
            }
            invalid(place, format!("{expected} rows, as in results"), n)
        };
        for (i, image) in self.images.iter().enumerate() {
            rows(format!("images[{i}].rows"), image.rows.len(), true)?;
        }
        for (i, tile) in self.tiles.iter().enumerate() {
            rows(format!("tiles[{i}].recovered_percent"), tile.recovered_percent.len(), false)?;
        }
        rows("run.seconds.rows".to_owned(), self.run.seconds.rows.len(), true)?;
        for (name, part) in [
            ("results", serde_json::to_value(&self.results)?),
            ("break_even", serde_json::to_value(&self.break_even)?),
            ("images", serde_json::to_value(&self.images)?),
            ("tiles", serde_json::to_value(&self.tiles)?),
            ("localization", serde_json::to_value(&self.localization)?),
        ] {
            shares(name, &part, None)?;
        }
        Ok(())
    }
}

fn check_row(place: &str, row: &Row) -> Result<(), Error> {
    let thresholds: Vec<&String> = row.recovered_percent.keys().collect();
    let alone = row.records_alone_percent.as_ref().map(|by| by.keys().collect());
    let by = row.records_alone_by.as_ref().map(|by| by.keys().collect());
    let has_alone = alone.is_some() || by.is_some();
    let same = |field: &str, keys: Option<Vec<&String>>| {
        if keys.as_ref() == Some(&thresholds) {
            return Ok(());
        }
        let said = |keys: &[&String]| keys.iter().copied().cloned().collect::<Vec<_>>().join(", ");
        let found = keys.map_or_else(|| "nothing".to_owned(), |keys| said(&keys));
        let expected = format!("the thresholds {}", said(&thresholds));
        invalid(format!("{place}.{field}"), expected, found)
    };
    same("blind_percent", Some(row.blind_percent.keys().collect()))?;
    if has_alone {
        same("records_alone_percent", alone)?;
        same("records_alone_by", by)?;
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
    let named = [
        ("delta", Some(row.delta)),
        ("median_error", row.median_error),
        ("blind_median_error", row.blind_median_error),
        ("axis_accuracy_percent", row.axis_accuracy_percent),
        ("exact_percent", row.exact_percent),
        ("assignment_accuracy_percent", row.assignment_accuracy_percent),
        ("sure_percent", row.sure_percent),
        ("sure_correct_percent", row.sure_correct_percent),
    ];
    let named = named.map(|(name, value)| (name.to_owned(), value)).into_iter();
    let metrics =
        row.metrics.iter().map(|(name, &value)| (format!("metrics[{name:?}]"), Some(value)));
    let errors = row.error_percentiles.iter();
    let errors = errors.map(|(at, &value)| (format!("error_percentiles[{at:?}]"), value));
    for (field, value) in named.chain(metrics).chain(errors) {
        if let Some(value) = value.filter(|value| !value.is_finite()) {
            return invalid(format!("{place}.{field}"), "a finite number", value);
        }
    }
    Ok(())
}

/// Checks every number under a name of a percentage or a ratio: `highest` is its largest value. Numbers that are not finite are null
/// here. Figures of others, in `metrics`, have any range.
fn shares(place: &str, value: &Value, highest: Option<f64>) -> Result<(), Error> {
    match (value, highest) {
        (Value::Object(fields), _) => fields.iter().try_for_each(|(name, field)| match highest {
            _ if name == "metrics" => Ok(()),
            Some(_) if field.is_null() => {
                let place = format!("{place}[{name:?}]");
                invalid(place, "a number", "null or a number that is not finite")
            }
            Some(_) => shares(&format!("{place}[{name:?}]"), field, highest),
            None => shares(&format!("{place}.{name}"), field, highest_of(name)),
        }),
        (Value::Array(items), _) => {
            let mut items = items.iter().enumerate();
            items.try_for_each(|(i, item)| shares(&format!("{place}[{i}]"), item, highest))
        }
        (Value::Number(number), Some(highest)) => match number.as_f64() {
            Some(value) if (0.0..=highest).contains(&value) => Ok(()),
            value => {
                let expected = format!("a number from 0 to {highest}");
                invalid(place, expected, value.unwrap_or(f64::NAN))
            }
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

fn same_key(a: &Row, b: &Row) -> bool {
    a.is_same_cell(b) && a.inlier_ratio == b.inlier_ratio && a.k == b.k
}

fn invalid(
    place: impl Into<String>,
    expected: impl Into<String>,
    found: impl ToString,
) -> Result<(), Error> {
    Err(Error::Invalid { place: place.into(), expected: expected.into(), found: found.to_string() })
}
