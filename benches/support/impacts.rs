//! Impacts of each regime, for the benchmarks.

use vibroimpact::impact::{PreImpact, resolve};
use vibroimpact::{ImpactLaw, System};

use super::paper::paper;

/// One impact of each regime under Poisson's law, and one under the law as printed.
pub fn impacts() -> Vec<(&'static str, System, PreImpact)> {
    let system = |friction, law| paper(1.545).friction(friction).law(law).build().unwrap();
    let (sin, cos) = 0.4f64.sin_cos();
    let at = |v1, v2| PreImpact { cos, sin, v1, v2 };
    let mut all: Vec<_> = [
        (0.0, at(1.0, -0.5)),
        (0.3, at(1.0, 0.5)),
        (0.3, at(0.5, -1.0)),
        (0.3, at(1.0, -0.2)),
        (3.0, at(0.5, -1.0)),
        (3.0, at(1.0, 0.0)),
    ]
    .map(|(friction, pre)| {
        let system = system(friction, ImpactLaw::Poisson);
        (resolve(&system, &pre).unwrap().regime.kind().name(), system, pre)
    })
    .into();
    all.push(("as printed", system(0.3, ImpactLaw::Paper), at(0.5, -1.0)));
    all
}
