//! Enums whose variants have names.

/// Defines an enum with the name of each variant beside it: that in files and reports, and on the command line.
#[doc(hidden)]
#[macro_export]
macro_rules! named {
    ($(#[$of_type:meta])* pub enum $type:ident {
        $($(#[$of_variant:meta])* $variant:ident = $name:literal,)*
    }) => {
        $(#[$of_type])*
        pub enum $type { $($(#[$of_variant])* $variant,)* }

        impl $type {
            /// All variants, in the order of their discriminants.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$variant),*];

            /// Name in files and reports, and on the command line.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// Returns the variant called `name`, if there is one.
            pub fn named(name: &str) -> Option<Self> {
                Self::ALL.into_iter().find(|one| Self::name(*one) == name)
            }
        }
    };
}
