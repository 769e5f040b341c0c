//! Displacements of quadratic elements are those of scikit-fem, an independent program, on the same mesh with the same integration points.
//! Needs a Python with scikit-fem, named by `TONGUE_FIT_PYTHON`.

use crate::fixtures::scikit_fem::Tongue;
use crate::fixtures::solved;

#[test]
fn a_pulled_tongue_has_the_displacements_that_scikit_fem_finds() {
    let Some(python) = std::env::var_os("TONGUE_FIT_PYTHON") else {
        let required = std::env::var_os("TONGUE_FIT_REQUIRE_PYTHON").is_some();
        assert!(!required, "TONGUE_FIT_PYTHON must name a Python with scikit-fem");
        return;
    };
    // Displaced bones, and the published tensions of /a/.
    let published = [12.0, 0.0, 0.0, 0.0, 11.5, 0.0, 4.5, 0.0];
    for (h, far, tensions) in [(5.5e-3, [3e-3, -4e-3], [0.0; 8]), (4e-3, [0.0; 2], published)] {
        let tongue = Tongue::new(h, far, &tensions);
        let workspace = solved(&tongue.system, &[]);
        let theirs = tongue.by_scikit_fem(&python, 0.0, 1);
        let worst = tongue.largest_difference(workspace.positions(), &theirs);
        assert!(worst < 1e-11, "{worst:e} m");
    }
}
