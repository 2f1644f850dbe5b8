// hdl.memory.onchip for simulation: does the same in the same cycles. That one's Verilog names each
// byte that it holds at first; a simulator of a million words would take hours to build.
module chip_memory #(
    parameter ADDRESS_BITS = 14,
    parameter WORD_BITS = 128,
    parameter SIZE = 16384  // words
) (
    input wire clk,
    input wire rst,
    input wire request_valid,
    input wire [ADDRESS_BITS-1:0] request_address,
    input wire request_write,
    input wire [WORD_BITS/8-1:0] request_mask,
    input wire [WORD_BITS-1:0] request_data,
    output reg response_valid,
    output reg [WORD_BITS-1:0] response_data
);
    reg [WORD_BITS-1:0] words[0:SIZE-1];
    reg [WORD_BITS-1:0] word;
    reg read;
    wire [31:0] address = {{32 - ADDRESS_BITS{1'b0}}, request_address} % SIZE;
    integer k;
    initial for (k = 0; k < SIZE; k = k + 1) words[k] = 0;
    integer lane;
    always @(posedge clk) begin
        // stage 1: look it up
        read <= !rst && request_valid && !request_write;
        word <= words[address];
        for (lane = 0; lane < WORD_BITS / 8; lane = lane + 1)
            if (request_valid && request_write && request_mask[lane])
                words[address][8*lane+:8] = request_data[8*lane+:8];
        // stage 2: give it
        response_valid <= !rst && read;
        response_data <= word;
    end
endmodule
