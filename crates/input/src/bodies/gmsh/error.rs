//! Errors of reading Gmsh files: what is wrong, where, and what to do. Nodes and elements are named by their Gmsh tags.

use tongue_core::body::BodyError;

/// A problem and its byte, if there is one.
#[derive(Debug)]
pub(super) struct Located {
    pub at: Option<usize>,
    pub problem: String,
}

impl Located {
    pub fn into_error(self, origin: &str, bytes: &[u8], binary: bool) -> BodyError {
        let place = match self.at {
            None => String::new(),
            Some(at) if binary => format!(" (byte {at})"),
            Some(at) => format!(":{}", 1 + bytes.iter().take(at).filter(|b| **b == b'\n').count()),
        };
        BodyError(format!("{origin}{place}: {}", self.problem))
    }
}

pub(super) type Found<T> = Result<T, Located>;

/// A problem at a byte, or at none, in words as of `format!`.
macro_rules! wrong {
    (None, $($words:tt)*) => {
        $crate::bodies::gmsh::error::Located { at: None, problem: format!($($words)*) }
    };
    ($at:expr, $($words:tt)*) => {
        $crate::bodies::gmsh::error::Located { at: Some($at), problem: format!($($words)*) }
    };
}
pub(super) use wrong;
