//! `unlift recover`: released files in, positions out; no truth needed.

use unlift::recover::{RecoverOptions, Status, recover};
use unlift_io::stage::{read_neighborhoods, read_released, write_recovered};

use super::with_threads;
use crate::args::RecoverArgs;
use crate::exit::Outcome;
use crate::output::print;
use crate::progress::Spinner;

/// Recovers a released map.
pub fn run(args: &RecoverArgs) -> anyhow::Result<Outcome> {
    let released = read_released::<3>(&args.released)?;
    let (records, slots) = (released.n_records(), released.slots_per_record());
    let lists = read_neighborhoods(&args.neighbors, records, slots)?;
    let options = RecoverOptions {
        solver: args.solver,
        delta: args.delta,
        seed: args.seed,
        exact_constraints: !args.no_exact_constraints,
        ..RecoverOptions::default()
    };
    let alive = Spinner::new("recovering");
    let recovered = with_threads(args.threads, || {
        let result = recover(&released, &lists, &options);
        Ok(result.map_err(|error| unlift_io::Error::core(&args.released, error))?)
    })?;
    write_recovered(&args.out, &recovered)?;
    drop(alive);
    let n = recovered.status().iter().filter(|&&status| status == Status::Ok).count();
    print(&format!(
        "{n} of {} points recovered with delta {:.4} {}, in {}\n",
        recovered.n_slots(),
        recovered.delta(),
        recovered.unit().name(),
        args.out.display()
    ))?;
    Ok(Outcome::Done)
}
