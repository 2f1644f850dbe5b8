// A ULX3S as the tests see it: names of its pins, and the cells of an ECP5 that are in a design
// before synthesis. (Those of Yosys, IB and OBZ, are for synthesis only: IB drives its pin.)
module ulx3s_pins (
    input wire clock,
    input wire button,
    input wire rx,
    output wire tx,
    output wire [7:0] led
);
    top top (
        .clk25_0__io(clock),
        .button_0__io(button),
        .uart_0__rx__io(rx),
        .uart_0__tx__io(tx),
        .led_0__io(led[0]),
        .led_1__io(led[1]),
        .led_2__io(led[2]),
        .led_3__io(led[3]),
        .led_4__io(led[4]),
        .led_5__io(led[5]),
        .led_6__io(led[6]),
        .led_7__io(led[7])
    );
endmodule

module IB (input wire I, output wire O);
    assign O = I;
endmodule

module OBZ (input wire I, input wire T, output wire O);
    assign O = T ? 1'bz : I;
endmodule

// Passes its clock on: the oscillator of the simulation is as fast as the core is meant to be.
module EHXPLLL #(
    parameter CLKI_DIV = 1,
    parameter CLKFB_DIV = 1,
    parameter CLKOP_DIV = 8,
    parameter CLKOP_CPHASE = 0,
    parameter CLKOP_FPHASE = 0,
    parameter CLKOP_ENABLE = "ENABLED",
    parameter FEEDBK_PATH = "CLKOP"
) (
    input wire CLKI,
    input wire CLKFB,
    input wire RST,
    input wire STDBY,
    input wire PLLWAKESYNC,
    input wire ENCLKOP,
    input wire PHASESEL0,
    input wire PHASESEL1,
    input wire PHASEDIR,
    input wire PHASESTEP,
    input wire PHASELOADREG,
    output wire CLKOP,
    output wire LOCK
);
    // Locked after some cycles, in which the machine is in reset.
    reg [3:0] cycles = 0;
    always @(posedge CLKI) if (!LOCK) cycles <= cycles + 1;
    assign LOCK = &cycles;
    assign CLKOP = CLKI;
endmodule
