// The other end of a board's serial line, for simulation. Bytes are pushed to it and pulled from it
// in bulk, up to one bulk a cycle, so that Python seldom wakes. They go by the pins, 8N1, or, with
// DIRECT, by streams in place of the board's UART: one in two cycles to the board, since a link that
// has no way to say "wait" cannot execute what comes faster, and one a cycle from it.
module line_model #(
    parameter DIRECT = 0,
    parameter BIT_TIME = 4267,  // length of a bit on the pins, in 256ths of a cycle
    parameter BULK = 256,       // bytes that are pushed or pulled at once
    parameter DEPTH = 4096,     // bytes that wait each way, a power of two
    parameter QUIET = 65536,    // cycles without a byte before all is called idle, and 4 bytes' time:
                                // more than a board takes to execute a command
    parameter LULL = 32         // cycles without a byte that end an answer, and 2 bytes' time
) (
    input wire clk,
    input wire rst,  // nothing waits, nothing is on its way
    input wire busy,  // the board works, though no byte is on its way

    output wire to_pin,
    input wire from_pin,
    output reg to_valid,
    input wire to_ready,
    output reg [7:0] to_payload,
    input wire from_valid,
    output wire from_ready,
    input wire [7:0] from_payload,

    input wire [15:0] push,  // this many of push_bytes, the first lowest; room is for the asker to see
    input wire [8*BULK-1:0] push_bytes,
    output wire [15:0] waiting,  // pushed and not yet on their way
    input wire pull,  // in the next cycle, the next bytes are in pull_bytes
    output reg [15:0] pulled,  // this many
    output reg [8*BULK-1:0] pull_bytes,
    output wire [15:0] received,  // wait to be pulled
    output reg [31:0] framing_errors,
    output wire idle,  // for a while no byte has been on its way, and the board has not been busy
    output wire lull   // bytes have come, and then for a short while none
);
    localparam BYTE = DIRECT ? 1 : 10 * BIT_TIME / 256;  // cycles
    localparam LAST = DEPTH - 1;

    // To the board.
    reg [7:0] outgoing[0:DEPTH-1];
    reg [15:0] sent, pushed;  // counts, modulo 2**16
    assign waiting = pushed - sent;
    integer k;
    always @(posedge clk) begin
        for (k = 0; k < BULK; k = k + 1)
            if (k < push) outgoing[(pushed + k[15:0]) & LAST[15:0]] = push_bytes[8*k+:8];
        pushed <= rst ? 0 : pushed + push;
    end

    reg [3:0] bits_out;  // of the byte on its way, still to be sent; 0 for none
    reg [9:0] frame;     // stop, data, start
    integer left;        // 256ths of a cycle until its bit ends
    assign to_pin = bits_out == 0 || frame[0];
    always @(posedge clk) begin
        if (rst) begin
            sent <= 0;
            bits_out <= 0;
            to_valid <= 0;
        end else if (DIRECT) begin
            if (to_valid && to_ready) to_valid <= 0;
            else if (!to_valid && waiting != 0) begin
                to_valid <= 1;
                to_payload <= outgoing[sent & LAST[15:0]];
                sent <= sent + 1;
            end
        end else if (bits_out != 0 && left > 256) left <= left - 256;
        else if (bits_out > 1) begin
            bits_out <= bits_out - 1;
            frame <= {1'b1, frame[9:1]};
            left <= left - 256 + BIT_TIME;
        end else if (waiting != 0) begin
            bits_out <= 10;
            frame <= {1'b1, outgoing[sent & LAST[15:0]], 1'b0};
            left <= (bits_out != 0 ? left - 256 : 0) + BIT_TIME;
            sent <= sent + 1;
        end else bits_out <= 0;
    end

    // From the board.
    reg [7:0] incoming[0:DEPTH-1];
    reg [15:0] came, taken;  // counts, modulo 2**16
    reg [3:0] bits_in;  // of the byte that comes, still to be looked at; 0 for none
    reg [7:0] data;
    reg was_high;
    integer until_look;  // 256ths of a cycle
    wire look = bits_in != 0 && until_look <= 256;
    wire comes = DIRECT ? from_valid && from_ready : look && bits_in == 1 && from_pin;
    assign received = came - taken;
    assign from_ready = received != DEPTH;
    always @(posedge clk) begin
        if (comes) incoming[came & LAST[15:0]] = DIRECT ? from_payload : data;
        came <= rst ? 0 : came + {15'd0, comes};
        was_high <= !rst && from_pin;
        if (rst || DIRECT) begin
            bits_in <= 0;
            framing_errors <= 0;
        end else if (bits_in == 0) begin
            if (was_high && !from_pin) bits_in <= 10;
            until_look <= BIT_TIME / 2;
        end else if (look) begin
            bits_in <= bits_in == 10 && from_pin ? 0 : bits_in - 1;  // that was no start bit
            data <= {from_pin, data[7:1]};  // the stop bit is not in it, the start bit leaves it
            until_look <= until_look - 256 + BIT_TIME;
            if (bits_in == 1 && !from_pin) framing_errors <= framing_errors + 1;
        end else until_look <= until_look - 256;
    end

    integer j;
    always @(posedge clk) begin
        if (pull) begin
            pulled <= received < BULK ? received : BULK;
            for (j = 0; j < BULK; j = j + 1)
                pull_bytes[8*j+:8] <= j < received ? incoming[(taken + j[15:0]) & LAST[15:0]] : 8'd0;
        end
        taken <= rst ? 0 : !pull ? taken : received < BULK ? came : taken + BULK;
    end

    // What Python waits for.
    integer quiet, since;  // cycles
    wire under_way = busy || waiting != 0 || bits_out != 0 || bits_in != 0
        || DIRECT && (to_valid || from_valid);
    assign idle = !under_way && quiet >= QUIET + 4 * BYTE;
    assign lull = received != 0 && since >= LULL + 2 * BYTE;
    always @(posedge clk) begin
        quiet <= rst || under_way ? 0 : idle ? quiet : quiet + 1;
        since <= rst || comes ? 0 : lull ? since : since + 1;
    end
endmodule
