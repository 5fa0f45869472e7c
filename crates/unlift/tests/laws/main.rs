//! Tests of the library. Property tests run over all registered schemes (STYLE.md, rule 13).

/// Runs `law(name, scheme, arguments..)` on every scheme.
macro_rules! over_schemes {
    ($law:ident $(, $argument:expr)*) => {
        for entry in unlift::obfuscate::SCHEMES {
            match entry.dimensions() {
                2 => $law::<2>(entry.name, entry $(, $argument)*),
                _ => $law::<3>(entry.name, entry $(, $argument)*),
            }
        }
    };
}

mod alone;
mod architecture;
mod audit;
mod confidence;
mod degenerate;
mod gauge;
mod golden;
mod images;
mod leaks;
mod maps;
mod noise;
mod pins;
mod ranking;
mod records;
mod recovery;
mod shares;
mod small_maps;
mod sources;
mod views;
