//! Audits of files as library calls.

mod doubts;
mod images;
mod localization;
mod measures;
mod reading;
mod tiles;

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use unlift::Unit;
use unlift::obfuscate::{Scheme, SchemeOptions, scheme};
use unlift_audit::{Audit, Audited, Error, Gate, Input, Output, Prepared, Quiet};

/// Runs the audit of a map and writes nothing.
fn audited(prepared: &Prepared, input: &Input<'_>, gates: &[&str]) -> Result<Audited, Error> {
    let gates = gates.iter().map(|gate| Gate::parse(gate).unwrap()).collect();
    let audit = Audit { gates, ..Audit::new(Output::new(Path::new(""))) };
    audit.of_map(prepared).run(input, &Quiet)
}

/// Returns the schemes with these names.
fn schemes(names: &[&str], unit: Unit) -> Vec<Arc<dyn Scheme<3>>> {
    let options = SchemeOptions::usual(unit);
    let named = |name: &&str| scheme(name).unwrap().of_dimension::<3>(&options).unwrap();
    names.iter().map(named).collect()
}

/// Writes a map of `points` to `folder`.
fn write_map(folder: &Path, points: &[[f64; 3]]) -> PathBuf {
    let path = folder.join("map.csv");
    let mut text = String::new();
    points.iter().for_each(|[x, y, z]| writeln!(text, "{x},{y},{z}").unwrap());
    fs::write(&path, text).unwrap();
    path
}
