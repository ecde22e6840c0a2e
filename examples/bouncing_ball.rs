//! A ball falls on a table and bounces until it rests: a first program with the library.
//!
//! `cargo run --release --example bouncing_ball`

use std::error::Error;

use vibroimpact::{Contact, Event, Horizon, Simulation, State, System};

fn main() -> Result<(), Box<dyn Error>> {
    let (height, gravity, restitution) = (1.0, 9.8, 0.5_f64);
    // Without spring and drive the load is the weight; body 2 is a table that does not move.
    let ball = System::builder()
        .mass_ratio(0.0)
        .frequency_ratio(0.0)
        .restitution(restitution)
        .gap(height)
        .drive_frequency(0.0)
        .moment_amplitude(gravity)
        .contact(Contact::Direct)
        .build()?;
    let start = State::new(0.0, 0.0, 0.0, 0.0)?;

    let mut accumulation = f64::NAN;
    for event in Simulation::new(&ball, start)?.until(Horizon::Time(2.0)) {
        let event = event?;
        println!("{event}");
        if let Event::Chatter(chatter) = event {
            accumulation = chatter.time;
        }
    }

    // The first fall lasts sqrt(2 h/g), and each flight is r times as long as the one before.
    let known = (2.0 * height / gravity).sqrt() * (1.0 + restitution) / (1.0 - restitution);
    println!("the bounces end at t = {accumulation:.12}, in closed form {known:.12}");
    if (accumulation - known).abs() < 1e-12 {
        Ok(())
    } else {
        Err("the ball does not come to rest when it should".into())
    }
}
