//! The rules of `audit.json` that its types cannot express.

use crate::Error;
use crate::document::{
    ByThreshold, Document, ImageFigures, Localization, Row, SCHEMA, TileFigures,
};

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
        if let Some(scale) = self.input.scale_m_per_unit {
            positive("input.scale_m_per_unit", scale)?;
        }
        if let Some(unit) = self.input.unit_in_map_units {
            positive("input.unit_in_map_units", unit)?;
        }
        for (i, row) in self.results.iter().enumerate() {
            check_row(&format!("results[{i}]"), row)?;
            if let Some(j) = self.results[..i].iter().position(|other| same_key(other, row)) {
                let found = format!("the combination of results[{j}] again");
                return Err(invalid(format!("results[{i}]"), "a combination of its own", found));
            }
        }
        for (i, point) in self.break_even.iter().enumerate() {
            between(&format!("break_even[{i}].inlier_ratio"), point.inlier_ratio, 0.0, 1.0)?;
        }
        for (i, gate) in self.gates.iter().enumerate() {
            if let Some(found) = gate.found_percent {
                finite(&format!("gates[{i}].found_percent"), found)?;
            }
            if let Some(highest) = gate.highest_percent {
                finite(&format!("gates[{i}].highest_percent"), highest)?;
            }
            finite(&format!("gates[{i}].bound_percent"), gate.bound_percent)?;
            if gate.passed && (gate.found_percent.is_none() || gate.reason.is_some()) {
                let expected = "false where a figure is not known";
                return Err(invalid(format!("gates[{i}].passed"), expected, "true"));
            }
        }
        self.check_not_audited()?;
        for (i, image) in self.images.iter().enumerate() {
            check_image(&format!("images[{i}]"), image, self.results.len())?;
        }
        for (i, tile) in self.tiles.iter().enumerate() {
            check_tile(&format!("tiles[{i}]"), tile, self.results.len())?;
        }
        for (i, one) in self.localization.iter().enumerate() {
            check_localization(&format!("localization[{i}]"), one)?;
        }
        self.check_run()
    }

    fn check_not_audited(&self) -> Result<(), Error> {
        for (i, missing) in self.not_audited.iter().enumerate() {
            let has_rows = |row: &Row| row.scheme == missing.scheme;
            if missing.neighbors.is_none() && self.results.iter().any(has_rows) {
                let place = format!("not_audited[{i}].scheme");
                let found = format!("{}, which has rows", missing.scheme);
                return Err(invalid(place, "a scheme without rows in results", found));
            }
        }
        Ok(())
    }

    fn check_run(&self) -> Result<(), Error> {
        let seconds = &self.run.seconds;
        finite("run.seconds.total", seconds.total)?;
        if !seconds.rows.is_empty() && seconds.rows.len() != self.results.len() {
            let expected = format!("{} rows, as in results", self.results.len());
            return Err(invalid("run.seconds.rows", expected, seconds.rows.len().to_string()));
        }
        for (i, stages) in seconds.rows.iter().enumerate() {
            for (stage, &value) in stages {
                finite(&format!("run.seconds.rows[{i}].{stage}"), value)?;
            }
        }
        for (stage, &value) in &seconds.stages {
            finite(&format!("run.seconds.stages.{stage}"), value)?;
        }
        Ok(())
    }
}

fn check_localization(place: &str, one: &Localization) -> Result<(), Error> {
    between(&format!("{place}.failed_percent"), one.failed_percent, 0.0, 100.0)?;
    let held_out = one.held_out.as_ref();
    let errors = [
        ("multiple", one.multiple),
        ("center_error", one.center_error),
        ("rotation_error_degrees", one.rotation_error_degrees),
        ("held_out.center_error", held_out.and_then(|held_out| held_out.center_error)),
        ("held_out.multiple", held_out.and_then(|held_out| held_out.multiple)),
        (
            "held_out.rotation_error_degrees",
            held_out.and_then(|held_out| held_out.rotation_error_degrees),
        ),
    ];
    for (name, value) in errors {
        value.map_or(Ok(()), |value| between(&format!("{place}.{name}"), value, 0.0, f64::MAX))?;
    }
    held_out.map_or(Ok(()), |held_out| {
        percentages(&format!("{place}.held_out.recall_percent"), &held_out.recall_percent)
    })
}

fn check_row(place: &str, row: &Row) -> Result<(), Error> {
    between(&format!("{place}.inlier_ratio"), row.inlier_ratio, 0.0, 1.0)?;
    if !row.blind_percent.keys().eq(row.recovered_percent.keys()) {
        let keys = |map: &ByThreshold| map.keys().cloned().collect::<Vec<_>>().join(", ");
        let expected = format!("the thresholds {}", keys(&row.recovered_percent));
        return Err(invalid(format!("{place}.blind_percent"), expected, keys(&row.blind_percent)));
    }
    check_records_alone(place, row)?;
    let (distinct, std) = (row.distinct.as_ref(), row.std.as_ref());
    for (field, map) in [
        ("recovered_percent", Some(&row.recovered_percent)),
        ("blind_percent", Some(&row.blind_percent)),
        ("records_alone_percent", row.records_alone_percent.as_ref()),
        ("distinct.recovered_percent", distinct.map(|distinct| &distinct.recovered_percent)),
        ("distinct.blind_percent", distinct.map(|distinct| &distinct.blind_percent)),
        ("std.recovered_percent", std.map(|std| &std.recovered_percent)),
        ("std.blind_percent", std.map(|std| &std.blind_percent)),
    ] {
        map.map_or(Ok(()), |map| percentages(&format!("{place}.{field}"), map))?;
    }
    let of = row.interval.as_ref();
    for (field, intervals) in [
        ("recovered_percent", of.map(|of| &of.recovered_percent)),
        ("blind_percent", of.map(|of| &of.blind_percent)),
        ("records_alone_percent", of.map(|of| &of.records_alone_percent)),
    ] {
        for (typed, [low, high]) in intervals.into_iter().flatten() {
            let place = format!("{place}.interval.{field}[{typed:?}]");
            between(&place, *low, 0.0, *high)?;
            between(&place, *high, *low, 100.0)?;
        }
    }
    if let (Some(sure), Some(reason)) = (row.sure_percent, &row.sure_unknown) {
        let expected = format!("null, as sure_unknown says {reason:?}");
        return Err(invalid(format!("{place}.sure_percent"), expected, sure.to_string()));
    }
    let lost: usize = row.lost.values().sum();
    // With repeats each count is a rounded mean, so the sum may differ.
    if row.repeats == 1 && lost != row.n_lost {
        let expected = format!("a sum of {}", row.n_lost);
        return Err(invalid(format!("{place}.lost"), expected, lost.to_string()));
    }
    if row.n_lost > row.n_points {
        let expected = format!("at most {}", row.n_points);
        return Err(invalid(format!("{place}.n_lost"), expected, row.n_lost.to_string()));
    }
    for (field, value) in [
        ("delta", Some(row.delta)),
        ("median_error", row.median_error),
        ("blind_median_error", row.blind_median_error),
        ("axis_accuracy_percent", row.axis_accuracy_percent),
        ("exact_percent", row.exact_percent),
        ("assignment_accuracy_percent", row.assignment_accuracy_percent),
        ("sure_percent", row.sure_percent),
        ("sure_correct_percent", row.sure_correct_percent),
    ] {
        value.map_or(Ok(()), |value| finite(&format!("{place}.{field}"), value))?;
    }
    for (name, &value) in &row.metrics {
        finite(&format!("{place}.metrics[{name:?}]"), value)?;
    }
    for (percentile, value) in &row.error_percentiles {
        let place = || format!("{place}.error_percentiles[{percentile:?}]");
        value.map_or(Ok(()), |value| finite(&place(), value))?;
    }
    for (at, bin) in row.reliability.iter().flatten().enumerate() {
        for (field, value) in [("predicted", bin.predicted), ("observed", bin.observed)] {
            let place = || format!("{place}.reliability[{at}].{field}");
            value.map_or(Ok(()), |value| between(&place(), value, 0.0, 1.0))?;
        }
    }
    Ok(())
}

/// Checks that both fields of the records alone have the keys of the recovered percentages, or are
/// absent.
fn check_records_alone(place: &str, row: &Row) -> Result<(), Error> {
    let keys =
        |keys: &mut dyn Iterator<Item = &String>| keys.cloned().collect::<Vec<_>>().join(", ");
    let expected = keys(&mut row.recovered_percent.keys());
    let found = [
        ("percent", row.records_alone_percent.as_ref().map(|map| keys(&mut map.keys()))),
        ("by", row.records_alone_by.as_ref().map(|map| keys(&mut map.keys()))),
    ];
    if found.iter().all(|(_, keys)| keys.is_none()) {
        return Ok(());
    }
    for (field, keys) in found {
        if keys.as_ref() != Some(&expected) {
            let place = format!("{place}.records_alone_{field}");
            let expected = format!("the thresholds {expected}");
            return Err(invalid(place, expected, keys.unwrap_or_else(|| "nothing".to_owned())));
        }
    }
    Ok(())
}

fn check_tile(place: &str, tile: &TileFigures, n_results: usize) -> Result<(), Error> {
    if tile.recovered_percent.len() != n_results {
        let (expected, found) =
            (format!("{n_results} rows, as in results"), tile.recovered_percent.len().to_string());
        return Err(invalid(format!("{place}.recovered_percent"), expected, found));
    }
    for &corner in tile.bounds.iter().flatten().flatten() {
        finite(&format!("{place}.bounds"), corner)?;
    }
    let mut percent = tile.recovered_percent.iter();
    percent.try_for_each(|map| percentages(&format!("{place}.recovered_percent"), map))
}

fn check_image(place: &str, image: &ImageFigures, n_results: usize) -> Result<(), Error> {
    if !image.rows.is_empty() && image.rows.len() != n_results {
        let expected = format!("{n_results} rows, as in results");
        return Err(invalid(format!("{place}.rows"), expected, image.rows.len().to_string()));
    }
    for (at, row) in image.rows.iter().enumerate() {
        let place = format!("{place}.rows[{at}]");
        between(&format!("{place}.inlier_ratio"), row.inlier_ratio, 0.0, 1.0)?;
        percentages(&format!("{place}.recovered_percent"), &row.recovered_percent)?;
        percentages(&format!("{place}.distinct_percent"), &row.distinct_percent)?;
        if let Some(error) = row.median_error {
            finite(&format!("{place}.median_error"), error)?;
        }
    }
    Ok(())
}

fn same_key(a: &Row, b: &Row) -> bool {
    a.scheme == b.scheme
        && a.neighbors == b.neighbors
        && a.oracle_noise == b.oracle_noise
        && a.inlier_ratio == b.inlier_ratio
        && a.k == b.k
        && a.solver == b.solver
}

fn percentages(place: &str, map: &ByThreshold) -> Result<(), Error> {
    for (threshold, &value) in map {
        between(&format!("{place}[{threshold:?}]"), value, 0.0, 100.0)?;
    }
    Ok(())
}

fn between(place: &str, value: f64, low: f64, high: f64) -> Result<(), Error> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(invalid(place, format!("a number from {low} to {high}"), value.to_string()))
}

fn positive(place: &str, value: f64) -> Result<(), Error> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(invalid(place, "a number above zero", value.to_string()))
}

fn finite(place: &str, value: f64) -> Result<(), Error> {
    if value.is_finite() {
        return Ok(());
    }
    Err(invalid(place, "a finite number", value.to_string()))
}

fn invalid(
    place: impl Into<String>,
    expected: impl Into<String>,
    found: impl Into<String>,
) -> Error {
    Error::Invalid { place: place.into(), expected: expected.into(), found: found.into() }
}
