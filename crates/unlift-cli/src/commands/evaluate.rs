//! `unlift evaluate`: compares recovered points with the truth.

use std::path::PathBuf;

use unlift::audit::{Plan, Row, Threshold, measure};
use unlift::evaluate::blind;
use unlift::released::Released;
use unlift::truth::Secret;
use unlift::{About, RowOrder, Unit};
use unlift_audit::{Checked, evaluated};
use unlift_io::stage::{has_images, read_recovered_in, read_released, read_truth};

use super::common::RELEASED;
use super::image_stages::{Evaluated, evaluate_all};
use crate::args::EvaluateArgs;
use crate::exit::{Outcome, advise};
use crate::output::{print, table};
use crate::stderr;
use unlift_audit::released::{expect_slots, same_map};

pub fn run(args: &EvaluateArgs) -> crate::Result<Outcome> {
    if has_images(&args.truth)? {
        return images(args);
    }
    let (original, secret) = read_truth::<3>(&args.truth)?;
    let recovered = read_recovered_in::<3>(&args.recovered, original.reveal().unit())?;
    same_map(&args.recovered, recovered.about().map, &args.truth, secret.map())?;
    let released = released(args, &secret)?;
    let unit = original.reveal().unit();
    let thresholds = match args.thresholds.as_slice() {
        [] => Plan::<3>::new(unit).thresholds,
        given => given.to_vec(),
    };
    let mut checked = Checked::default();
    checked
        .add(&recovered, &original, &secret, released.as_ref())
        .map_err(|error| unlift_io::Error::core(&args.truth, error))?;
    let baseline = released.map(|released| blind(&released, &original, &secret));
    let (row, _) = measure(&recovered, &original, &secret, baseline.as_ref(), &thresholds)
        .map_err(|error| unlift_io::Error::core(&args.recovered, error))?;
    let mut notes = notes(recovered.about(), secret.slots_per_record());
    notes.extend(check(args, &checked, &thresholds, unit)?);
    report(args, &row, &notes)
}

fn images(args: &EvaluateArgs) -> crate::Result<Outcome> {
    let thresholds = match args.thresholds.as_slice() {
        [] => Plan::<2>::new(Unit::Pixel).thresholds,
        given => given.to_vec(),
    };
    let released = released_path(args);
    let Evaluated { row, about, checked } = evaluate_all(args, released.as_deref(), &thresholds)?;
    let mut notes = notes(about, 1);
    notes.extend(check(args, &checked, &thresholds, Unit::Pixel)?);
    report(args, &row, &notes)
}

/// Returns notes on results that may be wrong; an error if the files do not belong together.
fn check(
    args: &EvaluateArgs,
    checked: &Checked,
    thresholds: &[Threshold],
    unit: Unit,
) -> crate::Result<Vec<String>> {
    checked.notes(thresholds, unit).map_err(|error| {
        let error = unlift_io::Error::core(&args.recovered, error).into();
        match released_path(args) {
            Some(_) => error,
            None => advise(
                error,
                format!(
                    "put {RELEASED} beside the truth: records identify a map better than points"
                ),
            ),
        }
    })
}

fn report(args: &EvaluateArgs, row: &Row, notes: &[String]) -> crate::Result<Outcome> {
    for note in notes {
        stderr::note(format_args!("{}: {note}", args.recovered.display()));
    }
    print(&if args.json { format!("{:#}\n", evaluated(row, notes)?) } else { as_table(row) })?;
    Ok(Outcome::Done)
}

/// Returns the path of the released map beside the truth, for the blind baseline, if it exists.
fn released_path(args: &EvaluateArgs) -> Option<PathBuf> {
    Some(args.truth.with_file_name(RELEASED)).filter(|path| path.exists())
}

fn released(args: &EvaluateArgs, secret: &Secret) -> crate::Result<Option<Released<3>>> {
    let Some(path) = released_path(args) else { return Ok(None) };
    let released = read_released::<3>(&path)?;
    same_map(&path, Some(released.fingerprint()), &args.truth, secret.map())?;
    expect_slots(&path, &released, secret)?;
    Ok(Some(released))
}

/// Returns notes on a file that another program wrote.
fn notes(about: About, slots_per_record: usize) -> Vec<String> {
    let mut notes = Vec::new();
    if about.map.is_none() {
        let note = "does not name its released map; assumed to be that of the truth";
        notes.push(note.to_owned());
    }
    if about.order == RowOrder::Unstated && slots_per_record > 1 {
        let note = "does not state what its rows are counted by: each position is compared with the nearer point of its \
                    record, so the figures are upper bounds";
        notes.push(note.to_owned());
    }
    notes
}

/// Formats a percentage; one above zero never reads as zero.
fn percent(share: f64) -> String {
    if share > 0.0 && share < 0.05 { "under 0.1 %".to_owned() } else { format!("{share:.1} %") }
}

fn as_table(row: &Row) -> String {
    let unit = row.unit.name();
    let line = |what: String, figure: String| vec![what, figure];
    let mut lines = vec![line("released points".to_owned(), row.n_points.to_string())];
    for (reason, n) in &row.dropped {
        lines.push(line(format!("not released: {reason}"), n.to_string()));
    }
    for (label, share) in &row.recovered_percent {
        lines.push(line(format!("within {} {unit}", label), percent(*share)));
    }
    for (label, share) in &row.blind_percent {
        lines.push(line(format!("blind, within {} {unit}", label), percent(*share)));
    }
    for (reason, n) in &row.lost {
        lines.push(line(format!("lost: {reason}"), n.to_string()));
    }
    let median = row.median_error.map_or("-".to_owned(), |error| format!("{error:.4}"));
    lines.push(line(format!("median error, {unit}"), median));
    for (what, share) in [
        ("axes named", row.axis_accuracy_percent),
        ("exact: the published value", row.exact_percent),
        ("descriptors assigned", row.assignment_accuracy_percent),
        ("attacker 90 % sure", row.sure_percent),
        ("of these within", row.sure_correct_percent),
    ] {
        lines.extend(share.map(|share| line(what.to_owned(), percent(share))));
    }
    table(&lines, &[])
}
