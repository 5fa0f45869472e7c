//! Audits of files as library calls.

mod doubts;
mod images;
mod localization;
mod measures;
mod reading;
mod tiles;

use std::path::Path;
use std::sync::Arc;

use unlift::Unit;
use unlift::audit::Plan;
use unlift::obfuscate::{Scheme, SchemeOptions, scheme};
use unlift::recover::Builtin;
use unlift_audit::{
    Audit, Audited, Error, Gate, Input, Output, Preparation, Prepared, Quiet, prepare,
};

/// Runs the audit of a map and writes nothing.
fn audited(prepared: &Prepared, input: &Input<'_>, gates: &[&str]) -> Result<Audited, Error> {
    let gates = gates.iter().map(|gate| Gate::parse(gate).unwrap()).collect();
    let audit = Audit { gates, ..Audit::new(Output::new(Path::new(""))) };
    audit.of_map(prepared).run(input, &Quiet)
}

/// Prepares points in meters.
fn prepared(points: &[[f64; 3]]) -> Prepared {
    let preparation = Preparation { scale: Some(1.0), k: 20, ..Preparation::default() };
    prepare(points, None, &preparation).unwrap()
}

/// Returns a plan for points in meters, with little work.
fn plan(names: &[&str]) -> Plan<3> {
    Plan {
        schemes: schemes(names, Unit::Meter),
        inlier_ratios: vec![0.5],
        k: 20,
        solvers: vec![Arc::new(Builtin::Joint)],
        records_alone: false,
        ..Plan::new(Unit::Meter)
    }
}

/// Returns the schemes with these names.
fn schemes(names: &[&str], unit: Unit) -> Vec<Arc<dyn Scheme<3>>> {
    let options = SchemeOptions::usual(unit);
    let named = |name: &&str| scheme(name).unwrap().of_dimension::<3>(&options).unwrap();
    names.iter().map(named).collect()
}
