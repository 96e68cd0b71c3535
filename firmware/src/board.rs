//! The edge of the program: what a port to another board replaces.

use core::marker::PhantomData;

use embedded_hal_02::adc::{Channel, OneShot};
use stretch_receptor::code::AdcCode;

use crate::trial;

/// Something that converts one sample when asked.
///
/// embedded-hal 1.0 has no trait for converters, and that of 0.2
/// ([`OneShot`]) is still what most chips' crates implement; [`Pin`] makes one of
/// these from any of those. A chip whose crate has neither implements this.
pub trait Converter {
    /// Why there is no sample.
    type Error;

    /// Starts a conversion and waits for it: a few microseconds.
    fn convert(&mut self) -> Result<AdcCode, Self::Error>;
}

/// A converter of embedded-hal 0.2 and the pin that the bridge's amplifier is on.
pub struct Pin<Port, Adc, P> {
    adc: Adc,
    pin: P,
    port: PhantomData<Port>,
}

impl<Port, Adc, P> Pin<Port, Adc, P> {
    /// A converter and one of its pins.
    pub fn new(adc: Adc, pin: P) -> Self {
        Self { adc, pin, port: PhantomData }
    }
}

impl<Port, Adc, P> Converter for Pin<Port, Adc, P>
where
    P: Channel<Port>,
    Adc: OneShot<Port, u16, P>,
{
    type Error = Adc::Error;

    fn convert(&mut self) -> Result<AdcCode, Self::Error> {
        nb::block!(self.adc.read(&mut self.pin)).map(|code| AdcCode(code.into()))
    }
}

/// In place of a converter: the recorded trial.
pub struct Replay<I>(I);

/// The trial has ended.
pub struct Ended;

impl Replay<()> {
    /// From the first sample.
    pub fn new() -> Replay<impl Iterator<Item = AdcCode>> {
        Replay(trial::codes())
    }
}

impl<I: Iterator<Item = AdcCode>> Converter for Replay<I> {
    type Error = Ended;

    fn convert(&mut self) -> Result<AdcCode, Ended> {
        self.0.next().ok_or(Ended)
    }
}

/// The serial port of Arm's MPS2 boards (CMSDK UART 0), which QEMU emulates.
pub struct Uart(());

impl Uart {
    const BASE: usize = 0x4000_4000;

    /// Enables the transmitter.
    ///
    /// # Safety
    /// The program runs on an MPS2 board, and nothing else uses the port.
    pub unsafe fn take() -> Self {
        let uart = Self(());
        uart.write_register(0x10, 217); // 25 MHz / 115,200
        uart.write_register(0x08, 1);
        uart
    }

    fn write_register(&self, offset: usize, value: u32) {
        // SAFETY: a register of the port that `take` was promised.
        unsafe { ((Self::BASE + offset) as *mut u32).write_volatile(value) }
    }

    fn full(&self) -> bool {
        // SAFETY: as above.
        unsafe { ((Self::BASE + 0x04) as *const u32).read_volatile() & 1 != 0 }
    }
}

impl embedded_io::ErrorType for Uart {
    type Error = core::convert::Infallible;
}

impl embedded_io::Write for Uart {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Self::Error> {
        for &byte in bytes {
            while self.full() {}
            self.write_register(0, byte.into());
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }
}
