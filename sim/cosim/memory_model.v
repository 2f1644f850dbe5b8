// Memory behind a port of hdl.memory.port, for simulation: one word a cycle, a set latency, and
// stalls at random. Its words are loaded from and dumped to files, so that nobody moves them one
// by one.
module memory_model #(
    parameter ADDRESS_BITS = 28,
    parameter WORD_BITS = 128,
    parameter SIZE = 65536  // words
) (
    input wire clk,
    input wire rst,
    input wire [9:0] latency,  // cycles from request to response, 1 to 1000
    input wire [15:0] stall,   // chance, in 65536ths, that a cycle takes no request, or that a
                               // response comes a cycle later
    input wire [31:0] seed,    // of the stalls, taken at reset; not 0

    input wire request_valid,
    output wire request_ready,
    input wire [ADDRESS_BITS-1:0] request_address,
    input wire request_write,
    input wire [WORD_BITS/8-1:0] request_mask,
    input wire [WORD_BITS-1:0] request_data,
    output reg response_valid,
    input wire response_ready,
    output reg [WORD_BITS-1:0] response_data,
    output reg outside,  // an address was beyond the memory; until reset

    input wire load,  // rises: words first to last from load.hex
    input wire dump,  // rises: words first to last to dump.hex
    input wire [ADDRESS_BITS-1:0] first,
    input wire [ADDRESS_BITS-1:0] last
);
    reg [WORD_BITS-1:0] words[0:SIZE-1];
    always @(posedge load) $readmemh("load.hex", words, first, last);
    always @(posedge dump) $writememh("dump.hex", words, first, last);

    // Reads under way, with the cycle in which each is due.
    reg [WORD_BITS-1:0] reads[0:1023];
    reg [31:0] due[0:1023];
    reg [9:0] head, tail;
    wire [9:0] under_way = tail - head;

    reg [31:0] now, random;
    reg accepts;
    assign request_ready = accepts && under_way != 10'h3ff;

    integer k;
    always @(posedge clk) begin
        if (rst) begin
            now = 0;
            random = seed;
            head = 0;
            tail = 0;
            accepts <= 0;
            response_valid <= 0;
            outside <= 0;
        end else begin
            now = now + 1;
            random = random ^ (random << 13);
            random = random ^ (random >> 17);
            random = random ^ (random << 5);
            if (request_valid && request_ready) begin
                if (request_address >= SIZE) outside <= 1;
                else if (request_write) begin
                    for (k = 0; k < WORD_BITS / 8; k = k + 1)
                        if (request_mask[k]) words[request_address][8*k+:8] = request_data[8*k+:8];
                end
                if (!request_write) begin
                    reads[tail] = request_address < SIZE ? words[request_address] : 0;
                    due[tail] = now - 1 + {22'd0, latency};
                    tail = tail + 1;
                end
            end
            if (!response_valid || response_ready) begin
                if (head != tail && due[head] <= now && random[31:16] >= stall) begin
                    response_valid <= 1;
                    response_data <= reads[head];
                    head = head + 1;
                end else response_valid <= 0;
            end
            accepts <= random[15:0] >= stall;
        end
    end
endmodule
