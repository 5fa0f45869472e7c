//! `unlift compare`: compares two audits.

use std::io::Write;
use std::path::Path;

use unlift::OneLine;
use unlift_audit::refused;
use unlift_io::Error;
use unlift_io::atomic::{Access, write_file};
use unlift_io::outputs::{Kind, OutputSet, Rules};
use unlift_report::compare::{Change, Comparison, Unmatched, compare, page};

use super::common::read_document;
use crate::args::CompareArgs;
use crate::output::{print, table};

const PAGE: &str = "compare.html";

/// Compares two audits, and returns false if the later one leaks more.
pub fn run(args: &CompareArgs) -> crate::Result<bool> {
    let (old, new) = (read_document(&args.old)?, read_document(&args.new)?);
    // A comparison of share-safe audits is readable by others, like the audits.
    let named = old.input.path.is_some() || new.input.path.is_some();
    let access = if named { Access::Private } else { Access::Usual };
    let out = match &args.out {
        Some(out) => {
            let rules = Rules::new([args.old.as_path(), args.new.as_path()], false);
            let files = OutputSet::create(out, rules, access, &[(PAGE, Kind::Page)]);
            Some(files.map_err(refused)?)
        }
        None => None,
    };
    let comparison = compare(&old, &new, args.accept.clone()).map_err(|wrong| {
        let expected = format!("{}, as in {}", wrong.expected, args.old.display());
        Error::new(&args.new, wrong.place, expected, wrong.found)
    })?;
    if let Some(mut files) = out {
        let text = page(&comparison, &old, &new)?;
        let staged = files.stage(PAGE, Kind::Page)?;
        write_file(&staged, access, |w| w.write_all(text.as_bytes()))?;
        files.commit()?;
    }
    print(&match args.json {
        true => serde_json::to_string_pretty(&comparison)? + "\n",
        false => text(&comparison, args.out.as_deref()),
    })?;
    Ok(comparison.passed)
}

fn text(comparison: &Comparison, out: Option<&Path>) -> String {
    let accepted = match &comparison.accepted {
        None => "OTHER INPUT".to_owned(),
        Some(accepted) if accepted.past => {
            format!("OTHER INPUT, and --accept ended on {}", accepted.until)
        }
        Some(accepted) => format!("accepted until {} ({})", accepted.until, accepted.reason),
    };
    let differs = |what: &String| format!("{}: {}\n", OneLine(&accepted), OneLine(what));
    let mut text: String = comparison.different.iter().map(differs).collect();
    let changed = [(&comparison.more, "leaks more"), (&comparison.less, "leaks less")];
    if changed.iter().any(|(changes, _)| !changes.is_empty()) {
        let heads = ["scheme", "attack", "within", "old", "new", "points", ""];
        let mut rows = vec![heads.map(str::to_owned).to_vec()];
        for (changes, word) in changed {
            rows.extend(changes.iter().map(|change| cells(change, word)));
        }
        text.push_str(&table(&rows, &[1, 6]));
    }
    let doubtful = |doubt: &String| format!("DOUBTFUL: {doubt}");
    let mut lines: Vec<String> = comparison.doubts.iter().map(doubtful).collect();
    for (rows, which) in [
        (&comparison.only_old, "NOT COMPARED: only in the old audit"),
        (&comparison.only_new, "only in the new audit"),
    ] {
        let line = |Unmatched { scheme, attack }: &_| format!("{which}: {scheme}: {attack}");
        lines.extend(rows.iter().map(line));
    }
    for cost in &comparison.costs_more {
        let now =
            cost.new_multiple.map_or("no pose or not known".into(), |new| format!("{new:.2}"));
        let (scheme, was) = (&cost.scheme, cost.old_multiple);
        lines.push(format!(
            "LOCALIZES LESS PRECISELY: {scheme}: {was:.2} times the unprotected error before, {now} now"
        ));
    }
    for lost in &comparison.lost {
        let by = lost.neighbors.as_ref().map(|by| format!(" by {by}")).unwrap_or_default();
        lines.push(format!("NO LONGER AUDITED: {}{by}: {}", lost.scheme, lost.reason));
    }
    lines.iter().for_each(|line| text.push_str(&format!("{}\n", OneLine(line))));
    text.push_str(&format!("{}\n", comparison.summary()));
    if !comparison.different.is_empty() && comparison.accepted.is_none() {
        text.push_str("if the inputs differ on purpose: --accept 'REASON, until YYYY-MM-DD', or keep the new audit as the baseline\n");
    }
    if let Some(out) = out {
        text.push_str(&format!("\npage: {}\n", OneLine(out.join(PAGE).display())));
    }
    text
}

fn cells(change: &Change, word: &str) -> Vec<String> {
    vec![
        change.scheme.clone(),
        change.attack.clone(),
        change.threshold.clone(),
        format!("{:.1} %", change.old_percent),
        format!("{:.1} %", change.new_percent),
        format!("{:+.1}", change.points),
        word.to_owned(),
    ]
}
