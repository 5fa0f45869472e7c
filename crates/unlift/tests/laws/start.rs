//! The pass that joint recovery starts from is the same whether it is asked for or left over.

use unlift::obfuscate::Entry;
use unlift::recover::{RecoverOptions, Solver, Unknown, recover, recover_with_start};

use crate::maps::{hide, recovered_bytes, room};

fn the_start_is_a_solver_of_its_own<const D: usize>(name: &str, scheme: &Entry) {
    let hidden = hide::<D>(scheme, &room(5, 400), 5);
    let lists = hidden.lists(12, 0.5, 5);
    for exact_constraints in [true, false] {
        let by = |solver| RecoverOptions {
            solver,
            seed: 2,
            exact_constraints,
            ..RecoverOptions::default()
        };
        let alone = |solver| recover(&hidden.released, &lists, &by(solver)).unwrap();
        let (joint, start) =
            recover_with_start(&hidden.released, &lists, &by(Solver::Joint)).unwrap();
        assert_eq!(recovered_bytes(&joint), recovered_bytes(&alone(Solver::Joint)), "{name}");
        let of_start = alone(Solver::JointStart);
        assert_eq!(recovered_bytes(&start), recovered_bytes(&of_start), "{name}");
        for start in [&start, &of_start] {
            assert_eq!(start.confidence_unknown(), Some(Unknown::OtherSolver), "{name}");
        }
        assert_eq!(start.delta(), joint.delta(), "{name}");
    }
}

#[test]
fn the_start_of_joint_recovery_is_a_solver_of_its_own() {
    over_schemes!(the_start_is_a_solver_of_its_own);
}

fn only_joint_has_a_start<const D: usize>(_: &str, scheme: &Entry) {
    let hidden = hide::<D>(scheme, &room(5, 60), 5);
    let lists = hidden.lists(6, 1.0, 5);
    let options = RecoverOptions { solver: Solver::Ransac, ..RecoverOptions::default() };
    let error = recover_with_start(&hidden.released, &lists, &options).unwrap_err();
    assert_eq!(error.to_string(), "solver: expected joint, found ransac");
}

#[test]
fn another_solver_has_no_start() {
    over_schemes!(only_joint_has_a_start);
}
