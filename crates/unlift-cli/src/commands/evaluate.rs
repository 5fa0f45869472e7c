//! `unlift evaluate`: recovered points and the truth in, figures out.

use serde_json::{Map, Value, json};
use unlift::audit::{Plan, Threshold};
use unlift::evaluate::{Accuracy, Reliability, evaluate, reliability};
use unlift_io::stage::{read_recovered, read_truth};

use crate::args::EvaluateArgs;
use crate::exit::Outcome;
use crate::output::{print, table};

/// Compares recovered points with the truth.
pub fn run(args: &EvaluateArgs) -> anyhow::Result<Outcome> {
    let recovered = read_recovered::<3>(&args.recovered)?;
    let (original, secret) = read_truth::<3>(&args.truth)?;
    let unit = original.reveal().unit();
    if recovered.unit() != unit {
        let expected = format!("lengths in {}, as in the truth", unit.name());
        let found = recovered.unit().name();
        return Err(unlift_io::Error::new(&args.recovered, "unit", expected, found).into());
    }
    let accuracy = evaluate(&recovered, &original, &secret)
        .map_err(|error| unlift_io::Error::core(&args.recovered, error))?;
    let thresholds = match args.thresholds.as_slice() {
        [] => Plan::new(unit).thresholds,
        given => given.to_vec(),
    };
    let smallest = thresholds.iter().map(|t| t.value).fold(f64::INFINITY, f64::min);
    let sure = reliability(&recovered, &accuracy, smallest);
    print(&if args.json {
        format!("{:#}\n", as_json(&accuracy, sure.as_ref(), &thresholds, unit.name()))
    } else {
        as_table(&accuracy, sure.as_ref(), &thresholds, unit.name())
    })?;
    Ok(Outcome::Done)
}

/// The figures under the names of `audit.json`.
fn as_json(
    accuracy: &Accuracy,
    sure: Option<&Reliability>,
    thresholds: &[Threshold],
    unit: &str,
) -> Value {
    let within: Map<String, Value> = thresholds
        .iter()
        .map(|t| (t.label.clone(), json!(accuracy.percent_within(t.value))))
        .collect();
    let lost: Map<String, Value> =
        accuracy.lost.iter().map(|(status, n)| (status.name().to_owned(), json!(n))).collect();
    json!({
        "unit": unit,
        "n_points": accuracy.n_points(),
        "n_lost": accuracy.n_lost(),
        "lost": lost,
        "recovered_percent": within,
        "axis_accuracy_percent": accuracy.axis_percent,
        "assignment_accuracy_percent": accuracy.assignment_percent,
        "sure_percent": sure.map(Reliability::sure_percent),
        "sure_correct_percent": sure.and_then(Reliability::sure_correct_percent),
        "median_error": accuracy.percentile(50.0),
    })
}

fn as_table(
    accuracy: &Accuracy,
    sure: Option<&Reliability>,
    thresholds: &[Threshold],
    unit: &str,
) -> String {
    let row = |what: String, figure: String| vec![what, figure];
    let mut rows = vec![row("points".to_owned(), accuracy.n_points().to_string())];
    for threshold in thresholds {
        let percent = accuracy.percent_within(threshold.value);
        rows.push(row(format!("within {} {unit}", threshold.label), format!("{percent:.1} %")));
    }
    for (status, n) in &accuracy.lost {
        rows.push(row(format!("lost: {}", status.name()), n.to_string()));
    }
    let median = accuracy.percentile(50.0).map_or("-".to_owned(), |e| format!("{e:.4}"));
    rows.push(row(format!("median error, {unit}"), median));
    for (what, percent) in [
        ("axes named", accuracy.axis_percent),
        ("descriptors assigned", accuracy.assignment_percent),
        ("attacker 90 % sure", sure.map(Reliability::sure_percent)),
        ("of these within", sure.and_then(Reliability::sure_correct_percent)),
    ] {
        if let Some(percent) = percent {
            rows.push(row(what.to_owned(), format!("{percent:.1} %")));
        }
    }
    table(&rows, &[])
}
