//! Itineraries, those read off a motion and any others, and the kernels of shooting on them.

#![no_main]

use libfuzzer_sys::fuzz_target;
use vibroimpact::tangent::itinerary::{Itinerary, Leg, Node};
use vibroimpact::analysis::shooting::Orbit;
use vibroimpact::{CancelToken, State, System};
use vibroimpact_fuzz::{Draw, MOST_EVENTS, execution, is_long};

const WORDS: [&str; 20] = [
    "circuit",
    "chatter",
    "slide+:release",
    "slide-:release",
    "slide+:stop",
    "slide-:stop",
    "stick:release",
    "stick:slide+",
    "stick:slide-",
    "impact:frictionless",
    "impact:slip:++",
    "impact:slip:-+",
    "impact:slip:+-",
    "impact:reversal_approach:++",
    "impact:reversal_restitution:-+",
    "impact:stick_approach:+-",
    "impact:stick_restitution:++",
    "impact:stick_restitution:--",
    "impact:slip:+",
    "impact:frictionless:++",
];

fn leg(draw: &mut Draw) -> Option<Leg> {
    let text =
        if draw.below(16) == 15 { draw.text() } else { WORDS[draw.below(WORDS.len())].to_owned() };
    let leg: Leg = text.parse().ok()?;
    let back: Leg = leg.to_string().parse().expect("a leg is read back");
    assert_eq!(back, leg);
    Some(leg)
}

fn followed(draw: &mut Draw, system: &System) -> Option<(Itinerary, Vec<Node>)> {
    let start = draw.state(system);
    let periods = if draw.below(8) == 7 { draw.integer() } else { 1 + draw.below(3) as i64 };
    // Nothing asks to end it: only what is short for any system.
    if is_long(system, &start, 7.0) || (4..i64::MAX / 2).contains(&periods) {
        return None;
    }
    Itinerary::follow(system, start, periods, MOST_EVENTS, &CancelToken::never()).ok()
}

fn anyhow(draw: &mut Draw) -> Option<(Itinerary, Vec<Node>)> {
    let legs: Vec<Leg> = (0..draw.below(5)).filter_map(|_| leg(draw)).collect();
    let clocks = (draw.below(2) == 0).then(|| legs.iter().map(|_| draw.integer()).collect());
    let periods = draw.integer();
    let nodes = legs
        .iter()
        .map(|_| Node::from_array(std::array::from_fn(|_| draw.number(-1.0, 2.0))))
        .collect();
    let itinerary = Itinerary::new(legs, periods, clocks, draw.below(4) == 3).ok()?;
    Some((itinerary, nodes))
}

/// A state that moves as fast as any of the nodes; no numbers stay none.
fn fastest(nodes: &[Node]) -> State {
    let largest = nodes
        .iter()
        .flat_map(|node| node.to_array())
        .fold(0.0, |most: f64, x| if x.abs() <= most { most } else { x.abs() });
    State { x1: largest, v1: largest, x2: largest, v2: largest }
}

fn body(draw: &mut Draw) {
    let Some(system) = draw.system() else { return };
    let pair = if draw.below(2) == 0 { followed(draw, &system) } else { anyhow(draw) };
    let Some((itinerary, mut nodes)) = pair else { return };
    if draw.below(8) == 7 && !nodes.is_empty() {
        let place = draw.below(nodes.len());
        nodes[place] = Node::from_array(std::array::from_fn(|_| draw.any()));
    }
    let Ok(orbit) = Orbit::new(&system, &itinerary, &nodes) else { return };
    let free: Vec<String> = (0..draw.below(4))
        .map(|_| {
            if draw.below(16) == 15 {
                draw.text()
            } else {
                System::NUMERIC[draw.below(System::NUMERIC.len())].to_owned()
            }
        })
        .collect();
    match orbit.residual(&free) {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(residual) => {
            assert_eq!(residual.values.len(), 4 * nodes.len());
            assert_eq!(residual.jacobian.len(), residual.values.len() * residual.columns);
        }
    }
    assert_eq!(orbit.transfer().len(), nodes.len());
    assert_eq!(orbit.before_events().len(), nodes.len());
    let _ = orbit.state_in_leg(draw.below(6), draw.number(0.0, 3.0));
    let _ = orbit.state_in_leg(draw.integer() as usize, draw.any());
    // Highest points are looked for all along a leg: only on short ones.
    let short = itinerary.clocks.iter().all(|clock| (0..4).contains(clock));
    if !short || itinerary.periods > 4 || is_long(&system, &fastest(&nodes), 8.0) {
        return;
    }
    assert_eq!(orbit.humps().len(), nodes.len());
    assert!(
        orbit.tests().iter().all(|test| test.condition.leg < nodes.len()
            && !test.condition.to_string().is_empty())
    );
}

fuzz_target!(|bytes: &[u8]| execution(|| body(&mut Draw::new(bytes))));
