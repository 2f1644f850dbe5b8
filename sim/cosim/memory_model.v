// Memory behind ports of hdl.memory.port, for simulation: one word a cycle and port, a set latency,
// and stalls at random. Its words are loaded from and dumped to files, so that nobody moves them
// one by one. Signals of several ports lie side by side, those of the first port lowest.
module memory_model #(
    parameter ADDRESS_BITS = 28,
    parameter WORD_BITS = 128,
    parameter PORTS = 1,
    parameter SIZE = 65536  // words
) (
    input wire clk,
    input wire rst,
    input wire [9:0] latency,  // cycles from request to response, 1 to 1000
    input wire [15:0] stall,   // chance, in 65536ths, that a cycle takes no request, or that a
                               // response comes a cycle later
    input wire [31:0] seed,    // of the stalls, taken at reset; not 0

    input wire [PORTS-1:0] request_valid,
    output wire [PORTS-1:0] request_ready,
    input wire [PORTS*ADDRESS_BITS-1:0] request_address,
    input wire [PORTS-1:0] request_write,
    input wire [PORTS*WORD_BITS/8-1:0] request_mask,
    input wire [PORTS*WORD_BITS-1:0] request_data,
    output reg [PORTS-1:0] response_valid,
    output reg [PORTS*WORD_BITS-1:0] response_data,
    output reg outside,  // an address was beyond the memory; until reset

    input wire load,  // rises: words first to last from load.hex
    input wire dump,  // rises: words first to last to dump.hex
    input wire [ADDRESS_BITS-1:0] first,
    input wire [ADDRESS_BITS-1:0] last
);
    reg [WORD_BITS-1:0] words[0:SIZE-1];
    always @(posedge load) $readmemh("load.hex", words, first, last);
    always @(posedge dump) $writememh("dump.hex", words, first, last);

    // Reads under way, 1024 a port, with the cycle in which each is due.
    reg [WORD_BITS-1:0] reads[0:1024*PORTS-1];
    reg [31:0] due[0:1024*PORTS-1];
    reg [9:0] head[0:PORTS-1];
    reg [9:0] tail[0:PORTS-1];

    reg [31:0] now, random;
    reg [PORTS-1:0] accepts, full;
    assign request_ready = accepts & ~full;

    integer p, k;
    reg [ADDRESS_BITS-1:0] address;
    reg [9:0] under_way;
    always @(posedge clk) begin
        if (rst) begin
            now = 0;
            random = seed;
            for (p = 0; p < PORTS; p = p + 1) begin
                head[p] = 0;
                tail[p] = 0;
            end
            accepts <= 0;
            full <= 0;
            response_valid <= 0;
            outside <= 0;
        end else begin
            now = now + 1;
            for (p = 0; p < PORTS; p = p + 1) begin
                random = random ^ (random << 13);
                random = random ^ (random >> 17);
                random = random ^ (random << 5);
                address = request_address[p*ADDRESS_BITS+:ADDRESS_BITS];
                if (request_valid[p] && request_ready[p]) begin
                    if (address >= SIZE) outside <= 1;
                    else if (request_write[p]) begin
                        for (k = 0; k < WORD_BITS / 8; k = k + 1)
                            if (request_mask[p*WORD_BITS/8+k])
                                words[address][8*k+:8] = request_data[p*WORD_BITS+8*k+:8];
                    end
                    if (!request_write[p]) begin
                        reads[{p[20:0], tail[p]}] = address < SIZE ? words[address] : 0;
                        due[{p[20:0], tail[p]}] = now - 1 + {22'd0, latency};
                        tail[p] = tail[p] + 1;
                    end
                end
                if (head[p] != tail[p] && due[{p[20:0], head[p]}] <= now
                        && random[31:16] >= stall) begin
                    response_valid[p] <= 1;
                    response_data[p*WORD_BITS+:WORD_BITS] <= reads[{p[20:0], head[p]}];
                    head[p] = head[p] + 1;
                end else response_valid[p] <= 0;
                accepts[p] <= random[15:0] >= stall;
                under_way = tail[p] - head[p];
                full[p] <= under_way == 10'h3ff;
            end
        end
    end
endmodule
