//! The Neutral File Format (NFF, version 3.9, by Eric Haines): reader and writer.
//!
//! The grammar, by tokens between white space; line ends mean nothing except to comments:
//!
//! | entity | what follows |
//! | --- | --- |
//! | `v` | `from x y z`, `at x y z`, `up x y z`, `angle a`, `hither h`, `resolution w h`: each once, in any order |
//! | `b` | background: `r g b` |
//! | `l` | light: `x y z` and, if a number follows, its colour `r g b` |
//! | `f` | material of all objects that follow: `r g b Kd Ks Shine T index_of_refraction` |
//! | `s` | sphere: `x y z radius` |
//! | `c` | open cone or cylinder: `base.xyz base_radius apex.xyz apex_radius` |
//! | `p` | polygon: `n`, then `n` times `x y z`; planar, perhaps concave |
//! | `pp` | patch: `n`, then `n` times `x y z nx ny nz` |
//! | `#` | comment to the end of the line, also right behind a token |
//!
//! What the format text leaves open is decided so:
//! * Numbers are decimal, finite, and at most `f32::MAX` in magnitude; they are kept as `f64`.
//!   `nan`, `inf`, hexadecimal numbers and `1.#IND` are refused.
//! * A file without any object is refused; a view, a background or a light is not required. A
//!   later `v` or `b` replaces an earlier one.
//! * The view's angle lies between 0 and 180 degrees, both excluded; the resolution is at least
//!   1 x 1.
//! * Spheres of radius 0 and cones without length or radius are accepted as degenerate and counted
//!   ([`NffStats::degenerate`]). The two radii of a cone must not differ in sign.
//! * Words that other programs add (a texture's name behind `f`, `tess`) are refused.
//!
//! ```
//! use ropewalk_scene::{NffLimits, Scene};
//! let scene = Scene::read_nff("f 1 0 0 1 0 1 0 1  s 0 0 0 2 # red ball".as_bytes(), &NffLimits::DEFAULT)?;
//! assert_eq!(scene.objects.len(), 1);
//! let error = Scene::read_nff("s 0 0 0 two".as_bytes(), &NffLimits::DEFAULT).unwrap_err();
//! assert_eq!(
//!     error.in_file("ball.nff").to_string(),
//!     r#"ball.nff:1:9: expected a number for the sphere's radius, found "two""#
//! );
//! # Ok::<(), ropewalk_scene::NffError>(())
//! ```

mod error;
mod lexer;
mod limits;
mod number_format;
mod parser;
mod writer;

pub use error::{NffError, NffErrorKind, NffReadError};
pub use limits::NffLimits;
pub use number_format::{NumberFormat, format_g};
pub use parser::{NffStats, read_nff};
pub use writer::NffWriter;
