//! Tests of parsing, covering and bounding.

use super::*;

fn row(scheme: &str, inlier_ratio: f64, recovered_percent: f64) -> Candidate<'_> {
    let inlier_ratio = Some(inlier_ratio);
    let (solver, source) = ("joint", "oracle");
    let (threshold, baseline_percent) = (0.1, 6.0);
    Candidate {
        scheme,
        solver,
        source,
        inlier_ratio,
        threshold,
        recovered_percent,
        baseline_percent,
    }
}

#[test]
fn the_full_form_is_read() {
    let gate = Gate::parse(" ppl+@0.5:0.10:gain<=15 ").unwrap();
    assert_eq!(gate.typed, "ppl+@0.5:0.10:gain<=15");
    assert_eq!(gate.scheme.as_deref(), Some("ppl+"));
    assert_eq!((gate.inlier_ratio, gate.threshold), (Some(0.5), 0.1));
    assert_eq!((gate.figure, gate.bound_percent), (Figure::Gain, 15.0));
}

#[test]
fn the_short_form_covers_every_row() {
    let gate = Gate::parse("all:0.1<=20%").unwrap();
    let rows = [row("olc", 1.0, 19.0), row("ppl", 0.5, 21.0), row("cp", 0.1, 3.0)];
    assert_eq!(gate.worst(rows), Some(21.0));
    assert!(!gate.passes(21.0) && gate.passes(20.0));
}

#[test]
fn other_rows_do_not_count_and_no_row_is_told() {
    let gate = Gate::parse("ppl@0.5:0.10<=20").unwrap();
    let rows = [row("ppl", 1.0, 99.0), row("olc", 0.5, 98.0), row("ppl", 0.5, 18.0)];
    assert_eq!(gate.worst(rows), Some(18.0));
    assert_eq!(gate.worst(rows[..2].iter().copied()), None);
}

#[test]
fn gain_is_what_recovery_adds() {
    let gate = Gate::parse("ppl:0.10:gain<=15").unwrap();
    assert_eq!(gate.worst([row("ppl", 0.5, 18.0)]), Some(12.0));
}

#[test]
fn a_measured_ratio_is_not_a_requested_one() {
    let candidate = Candidate { inlier_ratio: None, ..row("ppl", 0.5, 18.0) };
    assert_eq!(Gate::parse("ppl@0.5:0.10<=20").unwrap().worst([candidate]), None);
    assert_eq!(Gate::parse("ppl:0.10<=20").unwrap().worst([candidate]), Some(18.0));
}

#[test]
fn a_solver_and_a_source_may_be_named_in_any_order() {
    for text in ["ppl:joint:oracle@0.5:0.10<=20", "ppl:oracle:joint@0.5:0.10<=20"] {
        let gate = Gate::parse(text).unwrap();
        assert_eq!((gate.solver, gate.source.as_deref()), (Some("joint"), Some("oracle")));
        assert_eq!((gate.inlier_ratio, gate.threshold), (Some(0.5), 0.1));
    }
    let gate = Gate::parse("all:overlap:0.10:gain<=20").unwrap();
    assert_eq!((gate.solver, gate.source.as_deref()), (None, Some("overlap")));
    assert_eq!((gate.threshold, gate.figure), (0.1, Figure::Gain));
    let gate = Gate::parse("ppl+:joint-start:0.10<=20").unwrap();
    assert_eq!((gate.solver, gate.source), (Some("joint-start"), None));
}

#[test]
fn only_rows_of_the_named_solver_and_source_count() {
    let weak = Candidate { solver: "ransac", ..row("ppl", 0.5, 12.0) };
    let own = Candidate { source: "overlap", inlier_ratio: None, ..row("ppl", 0.1, 15.0) };
    let rows = [row("ppl", 0.5, 30.0), weak, own];
    let worst = |text: &str| Gate::parse(text).unwrap().worst(rows);
    assert_eq!(worst("ppl:0.10<=20"), Some(30.0), "the strongest attack decides");
    assert_eq!(worst("ppl:ransac:0.10<=20"), Some(12.0));
    assert_eq!(worst("ppl:overlap:0.10<=20"), Some(15.0));
    assert_eq!(worst("ppl:ransac:overlap:0.10<=20"), None);
}

#[test]
fn what_the_plan_lacks_is_named() {
    let mut plan = Plan::<3>::new(unlift::Unit::Meter);
    plan.schemes.retain(|scheme| scheme.name() == "ppl");
    plan.inlier_ratios = vec![1.0, 0.5];
    let lacking = |text: &str| {
        let part = Gate::parse(text).unwrap().not_in(&plan);
        part.map(|(expected, found)| format!("{expected}, found {found}"))
    };
    assert_eq!(lacking("ppl@0.5:0.10<=20"), None);
    assert_eq!(lacking("all:joint-start:oracle:0.25<=20"), None);
    let told = |text: &str| lacking(text).unwrap_or_default();
    assert_eq!(told("olc:0.10<=20"), "scheme: one of ppl, found olc");
    assert_eq!(
        told("ppl:ransac:0.10<=20"),
        "solver: one of ranking, joint, joint-start, found ransac"
    );
    assert_eq!(told("ppl:overlap:0.10<=20"), "neighbors: one of oracle, found overlap");
    assert_eq!(told("ppl@0.4:0.10<=20"), "inlier ratio: one of 1, 0.5, found 0.4");
    assert_eq!(told("ppl:0.2<=20"), "threshold: one of 0.10, 0.25, found 0.2");
}

#[test]
fn what_was_not_audited_is_missed() {
    let scheme = NotAudited {
        scheme: "ppl".to_owned(),
        neighbors: None,
        oracle_noise: None,
        inlier_ratio: None,
        reason: String::new(),
    };
    let lists =
        NotAudited { neighbors: Some("oracle".into()), inlier_ratio: Some(0.5), ..scheme.clone() };
    let misses = |text: &str, missing| Gate::parse(text).unwrap().misses(missing);
    assert!(misses("ppl:0.1<=20", &scheme) && misses("all@0.3:0.1<=20", &scheme));
    assert!(misses("ppl:overlap:0.1<=20", &scheme), "whatever the source");
    assert!(!misses("olc:0.1<=20", &scheme));
    assert!(misses("all:0.1<=20", &lists) && misses("ppl:oracle@0.5:0.1<=20", &lists));
    assert!(!misses("ppl:overlap:0.1<=20", &lists) && !misses("ppl@0.3:0.1<=20", &lists));
}

#[test]
fn a_figure_that_is_no_number_fails() {
    let gate = Gate::parse("ppl:0.10<=100").unwrap();
    assert!(!gate.passes(f64::NAN));
    // NaN decides, whatever the other figures.
    let rows = [row("ppl", 1.0, 3.0), row("ppl", 0.5, f64::NAN), row("ppl", 0.3, 2.0)];
    assert!(!gate.passes(gate.worst(rows).unwrap()));
}

#[test]
fn each_wrong_part_is_named() {
    let message = |text: &str| Gate::parse(text).unwrap_err();
    let form = "expected SCHEME[:SOLVER][:SOURCE][@RATIO]:THRESHOLD[:gain]<=PERCENT (for example ppl@0.5:0.10<=20)";
    assert_eq!(message("ppl@0.5:0.10<20"), format!("{form}, found no <="));
    assert_eq!(message("ppl<=20"), format!("{form}, found no threshold"));
    assert_eq!(message("ppl:0.1:loss<=20"), format!("{form}, found :loss (only :gain is known)"));
    assert_eq!(message("ppl@2:0.1<=20"), "inlier ratio: expected a number from 0 to 1, found 2");
    assert_eq!(message("ppl:x<=20"), "threshold: expected a number above 0, found x");
    assert_eq!(message("ppl:0.1<=120"), "bound: expected 0 to 100 percent, found 120");
    assert_eq!(message(":0.1<=20"), format!("{form}, found no scheme"));
    // Schemes may come from other crates, so only the plan can check the name.
    let unknown = Gate::parse("pl:0.1<=20").unwrap().not_in(&Plan::<3>::new(unlift::Unit::Meter));
    assert!(unknown.unwrap().0.starts_with("scheme: one of olc, ppl"));
    assert_eq!(message("ppl:joint<=20"), format!("{form}, found no threshold"));
    assert_eq!(message("ppl:joint@0.5<=20"), format!("{form}, found no threshold"));
    let names = "expected a solver (joint, ranking, joint-start, consensus, ransac, density, tomography) or \
                 a source of neighborhoods (oracle, file, similarity, overlap, geometric, learned, \
                 descriptors)";
    assert_eq!(message("ppl:jiont:0.1<=20"), format!("{names}, found jiont"));
    assert_eq!(message("ppl:jiont@0.5:0.1<=20"), format!("{names}, found jiont"));
    assert_eq!(message("ppl:0.1@0.5:0.1<=20"), format!("{names}, found 0.1"));
    assert_eq!(message("ppl:joint:ransac:0.1<=20"), "expected one solver, found joint and ransac");
    assert_eq!(message("ppl:oracle:file:0.1<=20"), "expected one source, found oracle and file");
    assert_eq!(
        message("ppl:joint:overlap@0.5:0.1<=20"),
        "inlier ratio: expected none with neighbors by overlap, whose ratio is measured, found @0.5"
    );
    assert_eq!(message("ppl:joint:x<=20"), "threshold: expected a number above 0, found x");
}

/// `olc` with `similarity` recovered 58.6 % but records alone 66.6 %, and a gate of 60 held.
#[test]
fn what_needs_no_neighborhoods_counts_unless_an_attack_is_named() {
    let candidate = Candidate { baseline_percent: 66.6, ..row("olc", 0.5, 58.6) };
    let worst = |text: &str| Gate::parse(text).unwrap().worst([candidate]);
    assert_eq!(worst("olc:0.10<=60"), Some(66.6));
    assert_eq!(worst("all@0.5:0.10<=60"), Some(66.6));
    assert_eq!(worst("olc:joint:0.10<=60"), Some(58.6));
    assert_eq!(worst("olc:oracle:0.10<=60"), Some(58.6));
}

#[test]
fn a_sequence_is_named_with_its_number_of_queries() {
    let gate = Gate::parse("dcl2d:sequence@5:10<=20").unwrap();
    assert_eq!(
        (gate.scheme.as_deref(), gate.source.as_deref()),
        (Some("dcl2d"), Some("sequence@5"))
    );
    assert_eq!((gate.inlier_ratio, gate.threshold, gate.bound_percent), (None, 10.0, 20.0));
    let gate = Gate::parse("dcl2d:sequence+lists@5:10<=20").unwrap();
    assert_eq!(gate.source.as_deref(), Some("sequence+lists@5"));
    let gate = Gate::parse("all:tracks@20:5:gain<=1").unwrap();
    assert_eq!((gate.source.as_deref(), gate.figure), (Some("tracks@20"), Figure::Gain));
}
