var e=(e,t)=>[e[0]+t[0],e[1]+t[1],e[2]+t[2]],t=(e,t)=>[e[0]-t[0],e[1]-t[1],e[2]-t[2]],n=(e,t)=>[e[0]*t,e[1]*t,e[2]*t],r=(e,t)=>e[0]*t[0]+e[1]*t[1]+e[2]*t[2],i=e=>Math.hypot(...e),a=e=>n(e,1/Math.max(i(e),1e-30)),o=(e,t)=>[e[1]*t[2]-e[2]*t[1],e[2]*t[0]-e[0]*t[2],e[0]*t[1]-e[1]*t[0]],s=(t,r,i)=>e(n(t,1-i),n(r,i));function c(t,i,a){let[s,c]=[Math.cos(a),Math.sin(a)];return e(e(n(t,s),n(o(i,t),c)),n(i,r(i,t)*(1-s)))}var l=1.54,u=[.01,2.8],[d,f]=[.001,10],p=3,m=class{eye=[0,0,-1];axes=[[1,0,0],[0,1,0],[0,0,1]];distance=1;up=[0,0,1];isLevel=!0;focal=1;reference=[1,1];middle=[0,0,0];bounds=[1e-6,1e6];take(e,n){this.eye=[...e.eye],this.axes=e.axes.map(e=>[...e]),this.reference=[...e.size],this.focal=.5*e.size[0]/Math.tan(.5*e.angle);let a=r(t(n,this.eye),this.axes[2]);this.setDistance(a>0?a:i(t(n,this.eye)))}stayNear(e,n,r){let a=i(t(n,e));this.middle=s(e,n,.5);let o=i(t(r,this.middle));this.bounds=[d*a,Math.max(f*a,p*o)]}get place(){return structuredClone({eye:this.eye,axes:this.axes,distance:this.distance,view:this.view})}goTo({eye:e,axes:t,distance:n,view:r}){[this.eye,this.axes]=structuredClone([e,t]),this.setDistance(n),this.view=r}get pivot(){return e(this.eye,n(this.axes[2],this.distance))}get view(){return 2*Math.atan(.5*Math.min(...this.reference)/this.focal)}set view(e){this.focal=.5*Math.min(...this.reference)/Math.tan(.5*h(e,u))}lookAt(e){this.axes=this.facing(a(t(e,this.eye))),this.setDistance(i(t(e,this.eye)))}frame(e,i){let a=s(e,i,.5),[o,c,l]=this.axes,u=n=>{let s=t([n&1?i[0]:e[0],n&2?i[1]:e[1],n&4?i[2]:e[2]],a);return Math.max(Math.abs(r(s,o)),Math.abs(r(s,c)))/Math.tan(.5*this.view)-r(s,l)};this.setDistance(Math.max(...Array.from({length:8},(e,t)=>u(t)))),this.eye=t(a,n(l,this.distance))}lookAlong(e){let r=this.pivot;this.axes=this.facing(a(e)),this.eye=t(r,n(this.axes[2],this.distance))}level(){let e=this.pivot,i=Math.asin(h(r(this.axes[2],this.up),[-1,1])),o=this.facing(this.axes[2])[0];this.axes=this.facing(a(c(this.axes[2],o,h(i,[-1.54,l])-i))),this.eye=t(e,n(this.axes[2],this.distance))}facing(e){let t=o(e,this.up),n=a(i(t)>1e-6?t:this.acrossOwn(e));return[n,a(o(e,n)),e]}acrossOwn(e){let a=i=>t(i,n(e,r(i,e))),[o,s]=[a(this.axes[0]),a(this.axes[1])];return i(o)>.5?o:s}orbit(e,r){let i=this.pivot;this.axes=this.isLevel?this.levelled(e,r):this.tumbled(e,r),this.eye=t(i,n(this.axes[2],this.distance))}levelled(e,t){let n=c(this.axes[2],this.up,e),i=Math.asin(h(r(n,this.up),[-1,1])),o=h(i+t,[-1.54,l]),s=this.facing(n)[0];return this.facing(a(c(n,s,o-i)))}tumbled(e,i){let[s,l,u]=this.axes,d=t=>c(c(t,l,-e),s,i),f=a(d(u)),p=d(s),m=a(t(p,n(f,r(p,f))));return[m,o(f,m),f]}look(e,t){let n=this.eye;this.orbit(e,t),this.eye=n}pan(t,r){let i=this.distance*Math.min(...this.reference)/this.focal;this.goBy(e(n(this.axes[0],t*i),n(this.axes[1],r*i)))}dolly(e){let[t,r]=this.bounds,i=h(this.distance*e,[t,Math.max(r,this.distance)]);this.goBy(n(this.axes[2],this.distance-i))&&(this.distance=i)}fly(t,r,i){let[a,o,s]=this.axes,c=e(e(n(a,t),n(o,r)),n(s,i));this.goBy(n(c,this.distance))}goBy(n){let r=e(this.eye,n);return i(t(r,this.middle))<=Math.max(this.bounds[1],i(t(this.eye,this.middle)))&&(this.eye=r,!0)}setDistance(e){this.distance=Math.max(this.bounds[0],e)}for(e){let t=Math.min(e[0]/this.reference[0],e[1]/this.reference[1]),n=h(2*Math.atan(.5*e[0]/(this.focal*t)),u);return{eye:this.eye,axes:this.axes,angle:n,size:e}}};function h(e,[t,n]){return Math.max(t,Math.min(n,e))}function g(e,t={},...n){let r=document.createElement(e);for(let[e,n]of Object.entries(t))n===!0?r.setAttribute(e,``):n!==!1&&r.setAttribute(e,n);return r.append(...n),r}function _(e,t,n){let r=g(`button`,{type:`button`,title:t},e);return/[a-z]/i.test(e)||r.setAttribute(`aria-label`,t.replace(/ \(.\)$/,``)),r.addEventListener(`click`,()=>n()),r}function v(e,t,n){let r=g(`input`,{type:`checkbox`});return r.addEventListener(`change`,()=>n(r.checked)),[g(`label`,{class:`check`,title:t},r,e),r]}var y=8;function b(e,t){let n=null,r=r=>{if(!n)return;let{before:i,wanted:a}=n;n=null,e.value=r?a:i,r&&a!==i&&t()};e.addEventListener(`pointerdown`,({pointerType:t,clientX:r,clientY:i})=>{t===`touch`&&(n={x:r,y:i,before:e.value,wanted:e.value})}),e.addEventListener(`pointermove`,({clientX:e,clientY:t})=>{if(!n)return;let[i,a]=[Math.abs(e-n.x),Math.abs(t-n.y)];Math.max(i,a)>y&&r(i>a)}),e.addEventListener(`pointerup`,()=>r(!0)),e.addEventListener(`pointercancel`,()=>r(!1)),e.addEventListener(`input`,()=>{if(!n)return t();n.wanted=e.value,e.value=n.before})}var ee=class{text;element;input;shown=g(`output`);constructor(e,[t,n,r],i,a){this.text=i,this.input=g(`input`,{type:`range`,min:String(t),max:String(n),step:String(r),"aria-label":e}),b(this.input,()=>{this.show(),a(this.input.valueAsNumber)}),this.element=g(`label`,{class:`slider`},g(`span`,{},e),this.shown,this.input)}set(e){this.input.value=String(e),this.show()}show(){this.shown.value=this.text(this.input.valueAsNumber),this.input.setAttribute(`aria-valuetext`,this.shown.value)}},[x,S]=[/^(Arrow|Page|Home|End)/,/^(Space|Enter|NumpadEnter)$/],te={range:x,checkbox:S,radio:x,button:S};function C(e){return e instanceof HTMLInputElement?te[e.type]??null:e instanceof HTMLTextAreaElement||e.isContentEditable?null:e instanceof HTMLSelectElement?/^(Arrow|Page|Home|End|Space|Enter|NumpadEnter|Escape)/:e.getAttribute(`role`)===`slider`?x:/^(BUTTON|A|SUMMARY)$/.test(e.tagName)?S:void 0}function w(e){if(e.ctrlKey||e.metaKey||e.altKey||document.querySelector(`dialog[open]`))return!0;let t=e.target instanceof HTMLElement?C(e.target):void 0;return t===null||t?.test(e.code)===!0}function T(e){return/^[a-z]$/i.test(e.key)?e.key.toUpperCase():e.code.replace(/^Key/,``)}var E=Math.PI,ne=.0012,D=.7,re=4,O=4,[k,A]=[2,4],j={KeyW:[0,0,1,0,0],KeyS:[0,0,-1,0,0],KeyA:[-1,0,0,0,0],KeyD:[1,0,0,0,0],KeyE:[0,-1,0,0,0],KeyQ:[0,1,0,0,0],ArrowLeft:[0,0,0,-1,0],ArrowRight:[0,0,0,1,0],ArrowUp:[0,0,0,0,-1],ArrowDown:[0,0,0,0,1]};function M(e,t,n){N(e,t,n),e.addEventListener(`wheel`,e=>{e.preventDefault();let r=e.deltaMode===WheelEvent.DOM_DELTA_LINE?30:1;t.dolly(Math.exp(ne*r*e.deltaY)),n.moved()},{passive:!1}),P(t,n)}function N(e,t,n){let r=new Map,i=0;e.addEventListener(`contextmenu`,e=>e.preventDefault()),e.addEventListener(`pointerdown`,t=>{e.setPointerCapture(t.pointerId),e.focus({preventScroll:!0}),r.size===0&&(i=0),r.set(t.pointerId,{x:t.clientX,y:t.clientY})}),e.addEventListener(`pointermove`,a=>{let o=r.get(a.pointerId);if(!o)return;let[s,c]=[a.clientX-o.x,a.clientY-o.y],l=Math.min(e.clientWidth,e.clientHeight);if(i+=Math.hypot(s,c),i<O)return;let u=[...r].filter(([e])=>e!==a.pointerId).map(([,e])=>e)[0];if(u){let e=(e,t)=>Math.max(10,Math.hypot(e-u.x,t-u.y));t.dolly(e(o.x,o.y)/e(a.clientX,a.clientY)),t.pan(-s/(2*l),-c/(2*l))}else a.buttons&k||a.shiftKey?t.pan(-s/l,-c/l):a.buttons&A&&a.ctrlKey?t.dolly(Math.exp(2*c/l)):a.ctrlKey||a.metaKey?t.look(-E*s/l/3,-E*c/l/3):t.orbit(-E*s/l,E*c/l);r.set(a.pointerId,{x:a.clientX,y:a.clientY}),n.moved()});let a=t=>{let n=e.querySelector(`#lines`).getBoundingClientRect();return[(t.clientX-n.left)/n.width,(t.clientY-n.top)/n.height]},o=e=>{!r.delete(e.pointerId)||r.size>0||e.type===`pointerup`&&i<O&&e.button===0&&n.click(...a(e))};e.addEventListener(`pointerup`,o),e.addEventListener(`pointercancel`,o),e.addEventListener(`dblclick`,e=>n.center(...a(e)))}function P(e,t){let n=new Set,[r,i]=[0,D],a=o=>{if(n.size===0)return;let s=Math.min(.1,(o-r)/1e3);r=o;for(let t of n){let[n,r,a,o,c]=j[t];e.fly(i*s*n,i*s*r,i*s*a),(o||c)&&e.orbit(-1.2*s*o,-1.2*s*c)}t.moved(),requestAnimationFrame(a)};addEventListener(`keydown`,e=>{i=e.shiftKey?D*re:D,e.code in j&&!w(e)&&(e.preventDefault(),n.size===0&&(r=performance.now(),requestAnimationFrame(a)),n.add(e.code))}),addEventListener(`keyup`,e=>{n.delete(e.code),e.shiftKey||(i=D)}),addEventListener(`blur`,()=>n.clear())}var F=`// The background at infinity, theory (3.15): an equirectangular panorama, or one colour.

// Fractional texel coordinates (column, row) of a unit direction.
fn texel_coordinates(d: vec3<f32>) -> vec2<f32> {
    let rows = f32(scene.rows);
    let flat = sqrt(max(d.x * d.x + d.y * d.y, POLE));
    return vec2<f32>((atan2(d.y, d.x) / TAU + 0.5) * 2.0 * rows - 0.5, atan2(flat, d.z) / (0.5 * TAU) * rows - 0.5);
}

// The four texels around a direction: left and right of the upper row, then of the lower one.
struct TexelCell {
    index: vec4<u32>,
    fraction: vec2<f32>,
}

fn texel_cell(d: vec3<f32>) -> TexelCell {
    let at = texel_coordinates(d);
    let low = floor(at);
    let columns = 2 * i32(scene.rows);
    let last = i32(scene.rows) - 1;
    // Columns lie in [−1, 2 rows): one turn makes them positive.
    let column = vec2<u32>((i32(low.x) + vec2<i32>(0, 1) + columns) % columns);
    let row = vec2<u32>(clamp(i32(low.y) + vec2<i32>(0, 1), vec2<i32>(0), vec2<i32>(last))) * u32(columns);
    return TexelCell(vec4<u32>(row.x + column, row.y + column), at - low);
}

fn texel_weights(f: vec2<f32>) -> vec4<f32> {
    let g = 1.0 - f;
    return vec4<f32>(g.x * g.y, f.x * g.y, g.x * f.y, f.x * f.y);
}

fn texel(i: u32) -> vec3<f32> {
    return vec3<f32>(texels[3u * i], texels[3u * i + 1u], texels[3u * i + 2u]);
}

// Radiance that arrives against a unit direction of travel.
fn background_radiance(d: vec3<f32>) -> vec3<f32> {
    if (scene.rows == 0u) {
        return scene.plain;
    }
    let cell = texel_cell(d);
    let w = texel_weights(cell.fraction);
    return w.x * texel(cell.index.x) + w.y * texel(cell.index.y) + w.z * texel(cell.index.z) + w.w * texel(cell.index.w);
}

// Transpose of its derivative by the direction, as a free vector.
fn background_radiance_vjp(d: vec3<f32>, d_radiance: vec3<f32>) -> vec3<f32> {
    if (scene.rows == 0u) {
        return vec3<f32>(0.0);
    }
    let rows = f32(scene.rows);
    let flat2 = max(d.x * d.x + d.y * d.y, POLE);
    let flat = sqrt(flat2);
    let d_column = vec3<f32>(-d.y, d.x, 0.0) * (2.0 * rows / (TAU * flat2));
    let d_row = vec3<f32>(d.x * d.z / flat, d.y * d.z / flat, -flat) * (rows / (0.5 * TAU));
    let cell = texel_cell(d);
    let f = cell.fraction;
    let v = vec4<f32>(
        dot(d_radiance, texel(cell.index.x)), dot(d_radiance, texel(cell.index.y)),
        dot(d_radiance, texel(cell.index.z)), dot(d_radiance, texel(cell.index.w)),
    );
    return d_column * mix(v.y - v.x, v.w - v.z, f.y) + d_row * mix(v.z - v.x, v.w - v.y, f.x);
}
`,I=`// Sparse bricks of 4³ nodes: \`grid/bricks.rs\` of refraxel-core.

// One of the voxels around a cell.
fn corner_of(slot: u32, local: u32, k: u32) -> u32 {
    let node = vec3<u32>(local & 3u, (local >> 2u) & 3u, local >> 4u) + vec3<u32>(k & 1u, (k >> 1u) & 1u, k >> 2u);
    let brick = node >> vec3<u32>(2u);
    let there = node & vec3<u32>(3u);
    return forward[slot * 8u + brick.x + 2u * brick.y + 4u * brick.z] + there.x + 4u * there.y + 16u * there.z;
}

// All voxels around a cell; corner k lies at +x for bit 0, +y for bit 1, +z for bit 2.
fn corners(slot: u32, local: u32) -> array<u32, 8> {
    let low = vec3<u32>(local & 3u, (local >> 2u) & 3u, local >> 4u);
    let high = low + 1u;
    // Where the upper corners lie: in the next brick along an axis or in the same one, and where there.
    let next = high >> vec3<u32>(2u);
    let there = high & vec3<u32>(3u);
    let row = slot * 8u;
    let b = vec3<u32>(next.x, next.y << 1u, next.z << 2u);
    let y = vec2<u32>(low.y, there.y) << vec2<u32>(2u);
    let z = vec2<u32>(low.z, there.z) << vec2<u32>(4u);
    return array<u32, 8>(
        forward[row] + low.x + y.x + z.x,
        forward[row + b.x] + there.x + y.x + z.x,
        forward[row + b.y] + low.x + y.y + z.x,
        forward[row + b.x + b.y] + there.x + y.y + z.x,
        forward[row + b.z] + low.x + y.x + z.y,
        forward[row + b.x + b.z] + there.x + y.x + z.y,
        forward[row + b.y + b.z] + low.x + y.y + z.y,
        forward[row + b.x + b.y + b.z] + there.x + y.y + z.y,
    );
}
`,L=`// Colour of theory (3.7). The coefficients of a voxel lie as on the host: BASIS of red, of green, of blue, then padding,
// four lanes to a block. Loops over
// corners are written out: some devices bound the iterations of an invocation.

// SH basis of a direction, repeated for each colour, 0 in the padding.
fn basis_lanes(direction: vec3<f32>) -> array<vec4<f32>, BLOCKS> {
    var y = sh_basis(direction);
    var lanes = array<vec4<f32>, BLOCKS>();
    for (var block = 0u; block < BLOCKS; block++) {
        let lane = 4u * block;
        lanes[block] = vec4<f32>(
            y[lane % BASIS], y[(lane + 1u) % BASIS], y[(lane + 2u) % BASIS], y[(lane + 3u) % BASIS],
        ) * vec4<f32>(channels(block) < vec4<u32>(3u));
    }
    return lanes;
}

// Which colour the lanes of a block belong to; 3 and above for padding.
fn channels(block: u32) -> vec4<u32> {
    return (vec4<u32>(4u * block) + vec4<u32>(0u, 1u, 2u, 3u)) / BASIS;
}

// The values of \`by_colour\` in the lanes of a block.
fn spread(block: u32, by_colour: vec3<f32>) -> vec4<f32> {
    let colours = channels(block);
    var out = select(vec4<f32>(0.0), vec4<f32>(by_colour.x), colours == vec4<u32>(0u));
    out = select(out, vec4<f32>(by_colour.y), colours == vec4<u32>(1u));
    return select(out, vec4<f32>(by_colour.z), colours == vec4<u32>(2u));
}

// The lanes of a block summed by colour: the transpose of \`spread\`.
fn gathered(block: u32, lanes: vec4<f32>) -> vec3<f32> {
    let colours = channels(block);
    return vec3<f32>(
        dot(lanes, vec4<f32>(colours == vec4<u32>(0u))),
        dot(lanes, vec4<f32>(colours == vec4<u32>(1u))),
        dot(lanes, vec4<f32>(colours == vec4<u32>(2u))),
    );
}

// A block of interpolated coefficients.
fn interpolated(block: u32, corner: array<u32, 8>, w: array<f32, 8>) -> vec4<f32> {
    return w[0] * colour_at(corner[0], block) + w[1] * colour_at(corner[1], block)
        + w[2] * colour_at(corner[2], block) + w[3] * colour_at(corner[3], block)
        + w[4] * colour_at(corner[4], block) + w[5] * colour_at(corner[5], block)
        + w[6] * colour_at(corner[6], block) + w[7] * colour_at(corner[7], block);
}

// c = max(Σ_j Y_j k_j + ½, 0) at a sample.
fn shade(corner: array<u32, 8>, w: array<f32, 8>, basis: ptr<function, array<vec4<f32>, BLOCKS>>) -> vec3<f32> {
    var sum = vec3<f32>(0.5);
    for (var block = 0u; block < BLOCKS; block++) {
        sum += gathered(block, interpolated(block, corner, w) * (*basis)[block]);
    }
    return max(sum, vec3<f32>(0.0));
}
`,R=`// The density of theory (3.5) and the opacity of theory (3.9), accurate to a few units in the last place on any device:
// the logarithm of a device may be wrong by 2⁻²¹ near 1, and 1 − eˣ cancels.

// ln(1 + u) for u in [0, 1]: 2 artanh(s), s = u / (2 + u) ≤ 1/3, truncated after s¹⁵: error 1e-9.
fn ln_1p(u: f32) -> f32 {
    let s = u / (2.0 + u);
    let q = s * s;
    let p = 2.0 / 3.0 + q * (2.0 / 5.0 + q * (2.0 / 7.0 + q * (2.0 / 9.0 + q * (2.0 / 11.0 + q * (2.0 / 13.0 + q * (2.0 / 15.0))))));
    return s * (2.0 + q * p);
}

// ln(1 + eˣ).
fn softplus(x: f32) -> f32 {
    return max(x, 0.0) + ln_1p(exp(-abs(x)));
}

// The derivative of softplus.
fn logistic(x: f32) -> f32 {
    let e = exp(-abs(x));
    return select(e, 1.0, x >= 0.0) / (1.0 + e);
}

// 1 − e^(−τ), τ ≥ 0. Below ¼ by its series up to τ⁷: error 1e-9.
fn opacity_of(tau: f32) -> f32 {
    if (tau > 0.25) {
        return 1.0 - exp(-tau);
    }
    return tau * (1.0 - tau / 2.0 * (1.0 - tau / 3.0 * (1.0 - tau / 4.0 * (1.0 - tau / 5.0 * (1.0 - tau / 6.0 * (1.0 - tau / 7.0))))));
}
`,z=`// Where the grid lies in the world, theory (3.2) and (3.3).

const CONTRACTED: u32 = 1u;
const PROJECTIVE: u32 = 2u;

// A direction as (right, down, ahead) of a projective grid.
fn turned(v: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(dot(scene.right, v), dot(scene.down, v), dot(scene.ahead, v));
}

// Normalised coordinates before contraction.
fn unit(x: vec3<f32>) -> vec3<f32> {
    if (scene.extent == PROJECTIVE) {
        let p = turned(x - scene.center);
        let middle = 0.5 * (scene.lowest.xy + scene.highest.xy);
        return vec3<f32>((p.xy / p.z - middle) * scene.unit_per_world.xy, 1.0 - scene.unit_per_world.z / p.z);
    }
    return (x - scene.center) * scene.unit_per_world;
}

fn max_element(v: vec3<f32>) -> f32 {
    return max(v.x, max(v.y, v.z));
}

// How fast normalised coordinates of a projective grid move along a line through x in direction v, times the squared depth: the
// same everywhere on it.
fn rate(x: vec3<f32>, v: vec3<f32>) -> vec3<f32> {
    let p = turned(x - scene.center);
    let w = turned(v);
    return vec3<f32>(w.xy * p.z - p.xy * w.z, w.z) * scene.unit_per_world;
}

// u (2/m − 1/m²) where m = ‖u‖∞ > 1 in a contracted domain.
fn contract(u: vec3<f32>) -> vec3<f32> {
    if (scene.extent != CONTRACTED) {
        return u;
    }
    let inverse = 1.0 / max(max_element(abs(u)), 1.0);
    return u * (inverse * (2.0 - inverse));
}

// Node coordinates of normalised ones, not below 0.
fn node_of_unit(u: vec3<f32>) -> vec3<f32> {
    return max((contract(u) + scene.reach) * scene.nodes_per_unit, vec3<f32>(0.0));
}

// Transpose of the derivative of the node coordinates: dLoss/dx from dLoss/dnode.
fn node_vjp(x: vec3<f32>, d_node: vec3<f32>) -> vec3<f32> {
    let d_u = d_node * scene.nodes_per_unit;
    if (scene.extent == PROJECTIVE) {
        let p = turned(x - scene.center);
        let d = d_u * scene.unit_per_world / p.z;
        return scene.right * d.x + scene.down * d.y + scene.ahead * ((d.z - d.x * p.x - d.y * p.y) / p.z);
    }
    let u = unit(x);
    let m = max_element(abs(u));
    if (scene.extent != CONTRACTED || m <= 1.0) {
        return d_u * scene.unit_per_world;
    }
    let inverse = 1.0 / m;
    var axis = vec3<f32>(0.0, 0.0, 1.0);
    if (abs(u.x) == m) {
        axis = vec3<f32>(1.0, 0.0, 0.0);
    } else if (abs(u.y) == m) {
        axis = vec3<f32>(0.0, 1.0, 0.0);
    }
    let slope = sign(dot(axis, u)) * 2.0 * inverse * inverse * (inverse - 1.0);
    return (d_u * (inverse * (2.0 - inverse)) + axis * (slope * dot(u, d_u))) * scene.unit_per_world;
}

// Factor by which steps grow at a point.
fn growth_at(x: vec3<f32>) -> f32 {
    return select(1.0, max(max_element(abs(unit(x))), 1.0), scene.extent == CONTRACTED);
}

// Bound on the nodes per unit of t that a point inside the box moves through, see \`NodeMap::fastest\` of the CPU backend.
fn fastest(momentum: vec3<f32>) -> f32 {
    let speed = abs(momentum) * scene.unit_per_world;
    if (scene.extent == CONTRACTED) {
        return max_element(scene.nodes_per_unit) * max_element(speed);
    }
    return max_element(speed * scene.nodes_per_unit);
}

// Bound on how much faster than inside the box a step can move through the nodes of a contracted grid.
fn stretch(growth: f32) -> f32 {
    return select(STRETCH, min(growth * STRETCH, STRETCH_MOST), growth > 1.0);
}

// Interval of t inside a slab; empty (1, 0) where a parallel ray passes beside it.
fn clip_axis(start: f32, momentum: f32, lowest: f32, highest: f32) -> vec2<f32> {
    if (momentum == 0.0) {
        return select(vec2<f32>(1.0, 0.0), vec2<f32>(0.0, FAR), start >= lowest && start <= highest);
    }
    let a = (lowest - start) / momentum;
    let b = (highest - start) / momentum;
    return vec2<f32>(min(a, b), max(a, b));
}

// Interval of t of a ray inside the grid from \`near\` on; empty where the first is not below the second.
fn clip(start: vec3<f32>, momentum: vec3<f32>, near: f32) -> vec2<f32> {
    if (scene.extent == PROJECTIVE) {
        return clip_frustum(turned(start - scene.center), turned(momentum), near);
    }
    let x = clip_axis(start.x, momentum.x, scene.lowest.x, scene.highest.x);
    let y = clip_axis(start.y, momentum.y, scene.lowest.y, scene.highest.y);
    let z = clip_axis(start.z, momentum.z, scene.lowest.z, scene.highest.z);
    let first = max(max(x.x, y.x), max(z.x, max(near, 0.0)));
    return vec2<f32>(first, min(x.y, min(y.y, z.y)));
}

// The same of a line in the frame of a projective grid.
fn clip_frustum(p: vec3<f32>, v: vec3<f32>, near: f32) -> vec2<f32> {
    let low = scene.lowest;
    let high = scene.highest;
    var range = vec2<f32>(max(near, 0.0), FAR);
    range = clip_plane(range, low.z - p.z, -v.z);
    range = clip_plane(range, p.z - high.z, v.z);
    range = clip_plane(range, low.x * p.z - p.x, low.x * v.z - v.x);
    range = clip_plane(range, p.x - high.x * p.z, v.x - high.x * v.z);
    range = clip_plane(range, low.y * p.z - p.y, low.y * v.z - v.y);
    return clip_plane(range, p.y - high.y * p.z, v.y - high.y * v.z);
}

// What of the t in a range is below a plane whose height over a line is height + t slope.
fn clip_plane(range: vec2<f32>, height: f32, slope: f32) -> vec2<f32> {
    if (slope < 0.0) {
        return vec2<f32>(max(range.x, -height / slope), range.y);
    }
    if (slope > 0.0) {
        return vec2<f32>(range.x, min(range.y, -height / slope));
    }
    return vec2<f32>(select(range.x, FAR, height > 0.0), range.y);
}
`,B=`// Where a path meets matter, theory (3.1) and (3.9): the march of the CPU backend, one ray per invocation.

// Where the march along a path stands.
struct Front {
    // x(t) = start + t momentum on the segment.
    start: vec3<f32>,
    momentum: vec3<f32>,
    // Of a projective grid: t where the segment begins, the depth there, and how fast it grows with t.
    entry: vec3<f32>,
    // The end of the segment. Here and below, points are even steps of a parameter apart: t, but in a projective grid the λ of
    // \`Perspective\` in Rust.
    end: f32,
    // Parameter of the first point of a group, length of a step, and how much longer it is than inside the box.
    first: f32,
    dt: f32,
    growth: f32,
    // Steps that a leap over the edge of a brick takes.
    steps_per_brick: f32,
    // The next point of the group.
    lane: u32,
    // Steps from the start of the next segment to its first point.
    phase: f32,
    transmittance: f32,
    // How much of a thin sample is due, theory (4.6).
    due: f32,
    // Nothing behind can be seen.
    opaque: bool,
}

// A quadrature point that matters.
struct Sample {
    slot: u32,
    local: u32,
    corner: array<u32, 8>,
    weight: array<f32, 8>,
    fraction: vec3<f32>,
    t: f32,
    // Optical depth τ, dτ/dθ, opacity 1 − e^(−τ), and the transmittance in front.
    tau: f32,
    slope: f32,
    alpha: f32,
    before: f32,
}

// The front before the first segment of a path.
fn front_of(offset: f32) -> Front {
    var front = Front();
    front.phase = offset;
    front.due = fract(offset * 4096.0 + 0.5); // \`thinning_phase\` in Rust
    front.transmittance = 1.0;
    return front;
}

// Begin a segment.
fn enter(front: ptr<function, Front>, start: vec3<f32>, momentum: vec3<f32>, range: vec2<f32>) {
    (*front).start = start;
    (*front).momentum = momentum;
    (*front).end = range.y;
    (*front).lane = 0u;
    if (scene.extent == PROJECTIVE) {
        begin_perspective(front, range);
        return;
    }
    begin_group(front, range.x, (*front).phase);
}

// A group of points at equal distances from \`t\` on, the first of them \`phase\` steps behind it.
fn begin_group(front: ptr<function, Front>, t: f32, phase: f32) {
    let per_t = 1.0 / length((*front).momentum);
    let growth = growth_at((*front).start + (*front).momentum * t);
    (*front).growth = growth;
    (*front).dt = task.step * growth * per_t;
    (*front).first = t + phase * (*front).dt;
    let nodes_per_step = fastest((*front).momentum) * task.step * per_t * stretch(growth);
    (*front).steps_per_brick = BRICK / nodes_per_step;
}

// Points at even steps through a projective grid.
fn begin_perspective(front: ptr<function, Front>, range: vec2<f32>) {
    let at = (*front).start + (*front).momentum * range.x;
    (*front).entry = vec3<f32>(range.x, dot(scene.ahead, at - scene.center), dot(scene.ahead, (*front).momentum));
    let length_t = range.y - range.x;
    (*front).end = length_t / ((*front).entry.y * ((*front).entry.y + (*front).entry.z * length_t));
    let nodes = rate((*front).start, (*front).momentum) * scene.nodes_per_unit;
    (*front).growth = 1.0;
    (*front).dt = task.step / (length(nodes) * scene.voxel);
    (*front).first = (*front).phase * (*front).dt;
    (*front).steps_per_brick = BRICK / (max_element(abs(nodes)) * (*front).dt * STRETCH);
}

// t of a parameter of the front's segment.
fn t_of(front: ptr<function, Front>, parameter: f32) -> f32 {
    if (scene.extent != PROJECTIVE) {
        return parameter;
    }
    let scaled = parameter * (*front).entry.y;
    return (*front).entry.x + scaled * (*front).entry.y / (1.0 - scaled * (*front).entry.z);
}

// Go to the next sample of the segment; false, with the phase of the next segment, if there is none.
fn next_sample(front: ptr<function, Front>, sample: ptr<function, Sample>) -> bool {
    var along = (*front).momentum * scene.unit_per_world;
    var origin = ((*front).start - scene.center) * scene.unit_per_world;
    if (scene.extent == PROJECTIVE) {
        along = rate((*front).start, (*front).momentum);
        origin = unit((*front).start + (*front).momentum * (*front).entry.x);
    }
    loop {
        if (scene.extent == CONTRACTED && (*front).lane >= GROUP && (*front).first + f32(GROUP - 1u) * (*front).dt <= (*front).end) {
            // A new step length, half a step in.
            (*front).lane = 0u;
            begin_group(front, (*front).first + (f32(GROUP) - 0.5) * (*front).dt, 0.5);
        }
        let t = (*front).first + f32((*front).lane) * (*front).dt;
        // Written so that it also ends the march of a ray that is not a number.
        if (!(t <= (*front).end)) {
            (*front).phase = (t - (*front).end) / (*front).dt;
            return false;
        }
        let g = node_of_unit(origin + t * along);
        let base = min(vec3<u32>(g), scene.last_cell);
        let entry = table[dot(base >> vec3<u32>(2u), scene.brick_strides)];
        if (entry <= 0) {
            let leap = u32(f32(-entry - 1) * (*front).steps_per_brick);
            (*front).lane += max(leap, 1u);
            continue;
        }
        (*front).lane += 1u;
        let slot = u32(entry);
        let local = (base.x & 3u) | ((base.y & 3u) << 2u) | ((base.z & 3u) << 4u);
        if (((occupied[2u * slot + (local >> 5u)] >> (local & 31u)) & 1u) == 0u) {
            continue;
        }
        let fraction = g - vec3<f32>(base);
        let corner = corners(slot, local);
        let w = trilinear_weights(fraction);
        let theta = w[0] * density[corner[0]] + w[1] * density[corner[1]] + w[2] * density[corner[2]]
            + w[3] * density[corner[3]] + w[4] * density[corner[4]] + w[5] * density[corner[5]]
            + w[6] * density[corner[6]] + w[7] * density[corner[7]];
        if (theta < task.theta_min) {
            continue;
        }
        let scale_length = scene.density_scale * task.step * (*front).growth;
        var tau = scale_length * softplus(theta);
        var slope = scale_length * logistic(theta);
        if (tau < task.thin) {
            // Left out by chance, or counted for those that are, theory (4.6).
            let share = tau / task.thin;
            (*front).due += share;
            if ((*front).due < 1.0) {
                continue;
            }
            (*front).due -= 1.0;
            tau = task.thin;
            slope /= share;
        }
        (*sample).slot = slot;
        (*sample).local = local;
        (*sample).corner = corner;
        (*sample).weight = w;
        (*sample).fraction = fraction;
        (*sample).t = t_of(front, t);
        (*sample).tau = tau;
        (*sample).slope = slope;
        (*sample).alpha = opacity_of(tau);
        (*sample).before = (*front).transmittance;
        (*front).transmittance *= 1.0 - (*sample).alpha;
        (*front).opaque = (*front).transmittance < task.min_transmittance;
        return true;
    }
    return false;
}

// Begin the path of a straight ray; false if it misses the grid.
fn enter_straight(front: ptr<function, Front>, origin: vec3<f32>, direction: vec3<f32>) -> bool {
    let range = clip(origin, direction, task.near);
    if (!(range.x < range.y)) {
        return false;
    }
    enter(front, origin, direction, range);
    return true;
}
`,V=`// What every kernel knows of the scene and of its task, and which invocation it is.

// The field's place in the world, and its background. The fields are those of \`field::Scene\` in Rust.
struct Scene {
    // Of the box; the eye of a projective grid.
    center: vec3<f32>,
    // Largest coordinate of the normalised, contracted space: 1 or 2.
    reach: f32,
    // Of a projective grid, one over half the widths of x/z and y/z, and twice the nearest depth.
    unit_per_world: vec3<f32>,
    // 40/L of theory (3.5) [1 / scene unit].
    density_scale: f32,
    nodes_per_unit: vec3<f32>,
    // Edge of a voxel inside the box [scene unit].
    voxel: f32,
    // The box that clips rays; of a contracted domain the far one; of a projective one, the lowest and highest x/z, y/z and z.
    lowest: vec3<f32>,
    // How far the grid reaches: 0, CONTRACTED or PROJECTIVE.
    extent: u32,
    highest: vec3<f32>,
    // Slots of the map, the empty one included.
    slots: u32,
    last_cell: vec3<u32>,
    // Rows of the environment map; 0 for a constant background.
    rows: u32,
    brick_strides: vec3<u32>,
    padding_0: u32,
    // Bricks per axis.
    bricks: vec3<u32>,
    padding_1: u32,
    // The constant background.
    plain: vec3<f32>,
    padding_2: u32,
    // The axes of a projective grid.
    right: vec3<f32>,
    padding_3: u32,
    down: vec3<f32>,
    padding_4: u32,
    ahead: vec3<f32>,
    padding_5: u32,
}

// What a dispatch does. The fields are those of \`task::Task\` in Rust.
struct Task {
    rays: u32,
    // Bits: WANTS_FIELD, WANTS_RAYS, GIVEN_BEHIND.
    wants: u32,
    // Quadrature step inside the box [scene unit].
    step: f32,
    near: f32,
    // Samples of lower raw density are transparent.
    theta_min: f32,
    min_transmittance: f32,
    sample_colour: f32,
    tv_density: f32,
    tv_colour: f32,
    tv_period: u32,
    // Number of the step modulo tv_period.
    tv_turn: u32,
    rate_density: f32,
    rate_colour: f32,
    rate_view: f32,
    rate_background: f32,
    // Where the outcome of the step goes.
    outcome: u32,
    // Samples of smaller optical depth are left out by chance.
    thin: f32,
    // Samples nearer to the camera move the field by less, theory (4.29).
    full_distance: f32,
    padding_0: u32,
    padding_1: u32,
}

// The number of an invocation in a dispatch of one or two dimensions.
fn invocation(group: vec3<u32>, groups: vec3<u32>, lane: u32) -> u32 {
    return (group.x + group.y * groups.x) * WORKGROUP + lane;
}

// Neither infinite nor NaN, told from the bits: a compiler may assume that comparisons never see either.
fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}
`,H=`// Real spherical harmonics, theory (3.6), in the order of \`sh.rs\` of refraxel-core; DEGREE is that of the field.

fn sh_basis(d: vec3<f32>) -> array<f32, MAX_BASIS> {
    var y = array<f32, MAX_BASIS>();
    y[0] = SH_C0;
    if (DEGREE == 0u) {
        return y;
    }
    y[1] = -SH_C1 * d.y;
    y[2] = SH_C1 * d.z;
    y[3] = -SH_C1 * d.x;
    if (DEGREE == 1u) {
        return y;
    }
    let q = d * d;
    y[4] = SH_C2_0 * d.x * d.y;
    y[5] = -SH_C2_0 * d.y * d.z;
    y[6] = SH_C2_1 * (2.0 * q.z - q.x - q.y);
    y[7] = -SH_C2_0 * d.x * d.z;
    y[8] = SH_C2_2 * (q.x - q.y);
    if (DEGREE == 2u) {
        return y;
    }
    y[9] = -SH_C3_0 * d.y * (3.0 * q.x - q.y);
    y[10] = SH_C3_1 * d.x * d.y * d.z;
    y[11] = -SH_C3_2 * d.y * (4.0 * q.z - q.x - q.y);
    y[12] = SH_C3_3 * d.z * (2.0 * q.z - 3.0 * q.x - 3.0 * q.y);
    y[13] = -SH_C3_2 * d.x * (4.0 * q.z - q.x - q.y);
    y[14] = SH_C3_5 * d.z * (q.x - q.y);
    y[15] = -SH_C3_0 * d.x * (q.x - 3.0 * q.y);
    return y;
}

// Transpose of the derivative of the basis, as polynomials of the free vector d, theory (3.14).
fn sh_basis_vjp(d: vec3<f32>, d_y: array<f32, MAX_BASIS>) -> vec3<f32> {
    if (DEGREE == 0u) {
        return vec3<f32>(0.0);
    }
    let q = d * d;
    var g = vec3<f32>(-SH_C1 * d_y[3], -SH_C1 * d_y[1], SH_C1 * d_y[2]);
    if (DEGREE >= 2u) {
        g += vec3<f32>(d.y, d.x, 0.0) * (SH_C2_0 * d_y[4]);
        g -= vec3<f32>(0.0, d.z, d.y) * (SH_C2_0 * d_y[5]);
        g += vec3<f32>(-2.0 * d.x, -2.0 * d.y, 4.0 * d.z) * (SH_C2_1 * d_y[6]);
        g -= vec3<f32>(d.z, 0.0, d.x) * (SH_C2_0 * d_y[7]);
        g += vec3<f32>(2.0 * d.x, -2.0 * d.y, 0.0) * (SH_C2_2 * d_y[8]);
    }
    if (DEGREE >= 3u) {
        g -= vec3<f32>(6.0 * d.x * d.y, 3.0 * q.x - 3.0 * q.y, 0.0) * (SH_C3_0 * d_y[9]);
        g += vec3<f32>(d.y * d.z, d.x * d.z, d.x * d.y) * (SH_C3_1 * d_y[10]);
        g -= vec3<f32>(-2.0 * d.x * d.y, 4.0 * q.z - q.x - 3.0 * q.y, 8.0 * d.y * d.z) * (SH_C3_2 * d_y[11]);
        g += vec3<f32>(-6.0 * d.x * d.z, -6.0 * d.y * d.z, 6.0 * q.z - 3.0 * q.x - 3.0 * q.y) * (SH_C3_3 * d_y[12]);
        g -= vec3<f32>(4.0 * q.z - 3.0 * q.x - q.y, -2.0 * d.x * d.y, 8.0 * d.x * d.z) * (SH_C3_2 * d_y[13]);
        g += vec3<f32>(2.0 * d.x * d.z, -2.0 * d.y * d.z, q.x - q.y) * (SH_C3_5 * d_y[14]);
        g -= vec3<f32>(3.0 * q.x - 3.0 * q.y, -6.0 * d.x * d.y, 0.0) * (SH_C3_0 * d_y[15]);
    }
    return g;
}
`,U=`// Trilinear interpolation over a cell, theory (3.4).

// Weight of one corner.
fn trilinear_weight(f: vec3<f32>, k: u32) -> f32 {
    let is_upper = vec3<u32>(k & 1u, (k >> 1u) & 1u, k >> 2u) == vec3<u32>(1u);
    let w = select(1.0 - f, f, is_upper);
    return w.x * (w.y * w.z);
}

// Weights of the eight corners.
fn trilinear_weights(f: vec3<f32>) -> array<f32, 8> {
    let g = 1.0 - f;
    let yz = vec4<f32>(g.y * g.z, f.y * g.z, g.y * f.z, f.y * f.z);
    return array<f32, 8>(
        g.x * yz.x, f.x * yz.x, g.x * yz.y, f.x * yz.y, g.x * yz.z, f.x * yz.z, g.x * yz.w, f.x * yz.w,
    );
}

fn bilinear(a: f32, b: f32, c: f32, d: f32, s: f32, t: f32) -> f32 {
    return mix(mix(a, b, s), mix(c, d, s), t);
}

// Gradient of the interpolated value [1 / node].
fn trilinear_gradient(f: vec3<f32>, v: array<f32, 8>) -> vec3<f32> {
    return vec3<f32>(
        bilinear(v[1] - v[0], v[3] - v[2], v[5] - v[4], v[7] - v[6], f.y, f.z),
        bilinear(v[2] - v[0], v[3] - v[1], v[6] - v[4], v[7] - v[5], f.x, f.z),
        bilinear(v[4] - v[0], v[5] - v[1], v[6] - v[2], v[7] - v[3], f.x, f.y),
    );
}
`,ie=`// Bent rays, theory (2.10) and (2.24)–(2.26): where they meet surfaces, and what becomes of them there.

// Steps of the search for a crossing in one body, steps through one field, and surfaces of a path.
const MOST_SAMPLES: u32 = 1024u;
const MOST_STEPS: u32 = 1024u;
const MOST_EVENTS: u32 = 24u;
// Distance of two samples of φ, and how far behind a surface the search for the next one begins [voxel].
const SPACING: f32 = 0.5;
const BEHIND: f32 = 0.02;

// The interval of t in which a line lies in the box of a region.
fn clip_region(r: u32, x: vec3<f32>, p: vec3<f32>) -> vec2<f32> {
    let low = regions[r].lowest;
    let high = low + vec3<f32>(regions[r].nodes - 1u) / regions[r].nodes_per_unit;
    let a = clip_axis(x.x, p.x, low.x, high.x);
    let b = clip_axis(x.y, p.y, low.y, high.y);
    let c = clip_axis(x.z, p.z, low.z, high.z);
    return vec2<f32>(max(a.x, max(b.x, c.x)), min(a.y, min(b.y, c.y)));
}

// Cells around that of a place without the surface of a body.
fn clearance_at(r: u32, at: vec3<f32>) -> u32 {
    let n = regions[r].nodes - 1u;
    let cell = min(vec3<u32>(max(at, vec3<f32>(0.0))), n - 1u);
    let i = regions[r].clearance + cell.x + n.x * (cell.y + n.y * cell.z);
    return (clearances[i >> 2u] >> (8u * (i & 3u))) & 255u;
}

// The interval of t in which a line is below all planes of a body.
fn below_planes(r: u32, x: vec3<f32>, p: vec3<f32>) -> vec2<f32> {
    let start = (x - regions[r].lowest) * regions[r].nodes_per_unit;
    let velocity = p * regions[r].nodes_per_unit;
    var below = vec2<f32>(-FAR, FAR);
    for (var k = 0u; k < regions[r].planes; k++) {
        let plane = plane_of(r, k);
        below = clip_plane(below, plane.w + dot(plane.xyz, start), dot(plane.xyz, velocity));
    }
    return below;
}

// The first t in a range at which a line leaves its side of the surface of a body: side +1 is outside, −1 inside. −1: never.
fn first_crossing(r: u32, x: vec3<f32>, p: vec3<f32>, range: vec2<f32>, side: f32) -> f32 {
    if (regions[r].planes == 0u) {
        return crossing_of_spline(r, x, p, range, side);
    }
    let below = below_planes(r, x, p);
    let is_of_planes = (regions[r].kind & IS_OF_PLANES) != 0u;
    if (side < 0.0) {
        let end = select(range.x, max(range.x, below.y), below.x < below.y);
        if (!is_of_planes) {
            let t = crossing_of_spline(r, x, p, vec2<f32>(range.x, min(end, range.y)), side);
            if (t >= 0.0) {
                return t;
            }
        }
        return select(-1.0, end, end <= range.y);
    }
    // Nothing comes back below a plane that it has left, or is about to leave.
    let behind = BEHIND / max_element(abs(p * regions[r].nodes_per_unit));
    if (below.x >= below.y || below.x > range.y || below.y <= range.x + behind) {
        return -1.0;
    }
    if (below.x >= range.x && (is_of_planes || level_of_spline(r, x + below.x * p).w <= 0.0)) {
        return below.x;
    }
    if (is_of_planes) {
        return -1.0;
    }
    return crossing_of_spline(r, x, p, vec2<f32>(max(below.x, range.x), min(below.y, range.y)), side);
}

// The same of its level set, whatever planes there are.
fn crossing_of_spline(r: u32, x: vec3<f32>, p: vec3<f32>, range: vec2<f32>, side: f32) -> f32 {
    let velocity = p * regions[r].nodes_per_unit;
    let per_voxel = 1.0 / max_element(abs(velocity));
    var t = range.x;
    var before = vec2<f32>(t, 1.0);
    var near = false;
    for (var k = 0u; k < MOST_SAMPLES; k++) {
        if (t > range.y) {
            break;
        }
        let clear = clearance_at(r, (x + t * p - regions[r].lowest) * regions[r].nodes_per_unit);
        if (clear > 1u) {
            near = false;
            t += (f32(clear) - 1.0) * per_voxel;
            continue;
        }
        let u = side * level_of_spline(r, x + t * p).w;
        if (u <= 0.0) {
            if (!near) {
                return t;
            }
            return crossing_between(r, x, p, before, vec2<f32>(t, u), side);
        }
        before = vec2<f32>(t, u);
        near = true;
        if (t == range.y) {
            break;
        }
        t = min(t + SPACING * per_voxel, range.y);
    }
    return -1.0;
}

// The zero of ±φ between two samples (t, ±φ) of different sign: false position, with halved weights so that both ends move.
fn crossing_between(r: u32, x: vec3<f32>, p: vec3<f32>, first: vec2<f32>, second: vec2<f32>, side: f32) -> f32 {
    var a = first;
    var b = second;
    for (var k = 0; k < 8; k++) {
        let t = (a.x * b.y - b.x * a.y) / (b.y - a.y);
        let u = side * level_of_spline(r, x + t * p).w;
        if (u > 0.0) {
            a = vec2<f32>(t, u);
            b.y *= 0.5;
        } else {
            b = vec2<f32>(t, u);
            a.y *= 0.5;
        }
    }
    return b.x;
}

// The region that rules at a place, theory (2.23); −1 is vacuum.
fn ruling_at(x: vec3<f32>) -> i32 {
    for (var k = i32(view.regions) - 1; k >= 0; k--) {
        if ((regions[k].kind & IS_BODY) != 0u && level(u32(k), x).w < 0.0) {
            return k;
        }
    }
    return -1;
}

// Where a ray next meets something: t, the region (−1: nothing), and the side of its surface.
struct Meeting {
    t: f32,
    region: i32,
    side: f32,
}

// From outside of all regions.
fn next_region(x: vec3<f32>, p: vec3<f32>, from_t: f32) -> Meeting {
    var best = Meeting(FAR, -1, 1.0);
    for (var r = 0u; r < view.regions; r++) {
        let span = clip_region(r, x, p);
        let range = vec2<f32>(max(span.x, from_t), min(span.y, best.t));
        if (!(range.x < range.y)) {
            continue;
        }
        var t = range.x;
        if ((regions[r].kind & IS_BODY) != 0u) {
            t = first_crossing(r, x, p, range, 1.0);
        }
        if (t >= 0.0 && t < best.t) {
            best = Meeting(t, i32(r), 1.0);
        }
    }
    return best;
}

// From inside a body: its own surface, or that of a body that rules over it.
fn next_surface(within: u32, x: vec3<f32>, p: vec3<f32>, most: f32) -> Meeting {
    let behind = BEHIND / max_element(abs(p * regions[within].nodes_per_unit));
    var best = Meeting(most, -1, -1.0);
    let own = first_crossing(within, x, p, vec2<f32>(behind, min(most, clip_region(within, x, p).y)), -1.0);
    if (own >= 0.0) {
        best = Meeting(own, i32(within), -1.0);
    }
    for (var r = within + 1u; r < view.regions; r++) {
        let span = clip_region(r, x, p);
        let range = vec2<f32>(max(span.x, behind), min(span.y, best.t));
        if ((regions[r].kind & IS_BODY) == 0u || !(range.x < range.y)) {
            continue;
        }
        let t = first_crossing(r, x, p, range, 1.0);
        if (t >= 0.0) {
            best = Meeting(t, i32(r), 1.0);
        }
    }
    return best;
}

// What rules behind the surface of a body.
fn ruling_behind(surface: i32, enters: bool, x: vec3<f32>, p: vec3<f32>) -> i32 {
    var beyond = select(-1, surface, enters);
    for (var k = i32(view.regions) - 1; k > beyond; k--) {
        if (k == surface || (regions[k].kind & IS_BODY) == 0u) {
            continue;
        }
        let ahead = x + p * (BEHIND / max_element(abs(p * regions[k].nodes_per_unit)));
        if (level(u32(k), ahead).w < 0.0) {
            beyond = k;
        }
    }
    return beyond;
}

// Fresnel's reflectance, theory (7.1), by the normal momenta and w on both sides.
fn reflectance(a: f32, s: f32, w_before: f32, w_after: f32) -> f32 {
    let across = (a - s) / (a + s);
    let along = (w_after * a - w_before * s) / (w_after * a + w_before * s);
    return 0.5 * (across * across + along * along);
}
`,W=`// The picture: each pixel follows its ray and collects what it meets, theory (3.9), (7.5) and (7.18).

// Light of sRGB codes, and back: IEC 61966-2-1.
fn light(code: vec3<f32>) -> vec3<f32> {
    let curve = pow((max(code, vec3<f32>(0.0)) + 0.055) / 1.055, vec3<f32>(2.4));
    return select(curve, code / 12.92, code <= vec3<f32>(0.04045));
}

fn code(light: vec3<f32>) -> vec3<f32> {
    let curve = 1.055 * pow(max(light, vec3<f32>(0.0)), vec3<f32>(1.0 / 2.4)) - 0.055;
    return select(curve, 12.92 * light, light <= vec3<f32>(0.0031308));
}

// What a ray has collected so far.
struct Seen {
    colour: vec3<f32>,
    // Optical thickness of the bodies so far.
    thickness: vec3<f32>,
}

// Collects along a straight piece; \`growth\` is that of the thickness in t.
fn collect(front: ptr<function, Front>, seen: ptr<function, Seen>, x: vec3<f32>, p: vec3<f32>, end: f32, near: f32, growth: vec3<f32>) {
    let inside = clip(x, p, near);
    let range = vec2<f32>(inside.x, min(inside.y, end));
    if (!(*front).opaque && range.x < range.y) {
        enter(front, x, p, range);
        var basis = basis_lanes(normalize(p));
        var s: Sample;
        while (!(*front).opaque && next_sample(front, &s)) {
            let thickness = (*seen).thickness + growth * s.t;
            var colour = shade(s.corner, s.weight, &basis);
            if (any(thickness > vec3<f32>(0.0))) {
                colour = code(light(colour) * exp(-thickness));
            }
            (*seen).colour += s.before * s.alpha * colour;
        }
    }
    if (end < FAR) {
        (*seen).thickness += growth * end;
    }
}

// What shows behind everything, attenuated.
fn behind(seen: Seen, direction: vec3<f32>) -> vec3<f32> {
    let colour = background_radiance(direction);
    return select(colour, code(light(colour) * exp(-seen.thickness)), any(seen.thickness > vec3<f32>(0.0)));
}

// What a straight ray shows, from where another one is reflected.
fn mirrored(x: vec3<f32>, d: vec3<f32>) -> vec3<f32> {
    var front = front_of(0.5);
    var seen = Seen();
    collect(&front, &seen, x, d, FAR, 0.0, vec3<f32>(0.0));
    return seen.colour + front.transmittance * behind(seen, d);
}

// The first surface that a ray enters from outside: what is seen before it, and what it mirrors.
struct Mirror {
    colour: vec3<f32>,
    before: f32,
    light: vec3<f32>,
    share: f32,
}

fn radiance(origin: vec3<f32>, direction: vec3<f32>) -> vec3<f32> {
    var front = front_of(0.5);
    var seen = Seen();
    var mirror = Mirror(vec3<f32>(0.0), 1.0, vec3<f32>(0.0), 0.0);
    var x = origin;
    var within = -1;
    if (view.straight == 0u) {
        within = ruling_at(origin);
    }
    var p = direction * sqrt(2.0 * field_of(within, x).w);
    var near = task.near / length(p);
    var from_t = 0.0;
    for (var event = 0u; event < MOST_EVENTS; event++) {
        if (front.opaque) {
            break;
        }
        var next = Meeting(FAR, -1, 1.0);
        var growth = vec3<f32>(0.0);
        if (within >= 0) {
            growth = regions[within].absorption * length(p);
            if ((regions[within].kind & IS_UNIFORM) != 0u) {
                next = next_surface(u32(within), x, p, FAR);
            } else {
                // Marched with half a kick first; kicks are those of theory (2.10).
                let h = regions[within].step;
                var kick = 0.5 * h;
                for (var k = 0u; k < MOST_STEPS; k++) {
                    p += field_of(within, x).xyz * kick;
                    kick = h;
                    next = next_surface(u32(within), x, p, h);
                    if (next.region >= 0 || front.opaque) {
                        break;
                    }
                    collect(&front, &seen, x, p, h, 0.0, regions[within].absorption * length(p));
                    x += p * h;
                }
            }
            if (next.region < 0) {
                break;
            }
        } else if (view.straight == 0u) {
            next = next_region(x, p, from_t);
        }
        collect(&front, &seen, x, p, next.t, near, growth);
        near = 0.0;
        from_t = 0.0;
        if (next.region < 0) {
            break;
        }
        x += p * next.t;
        if ((regions[next.region].kind & IS_BODY) == 0u) {
            // Through a field without a surface, to the face of its box.
            let r = next.region;
            let h = regions[r].step;
            var kick = 0.5 * h;
            for (var k = 0u; k < MOST_STEPS; k++) {
                p += field_of(r, x).xyz * kick;
                kick = h;
                let n = length(p);
                let share = clamp((n - 1.0) / max(regions[r].largest - 1.0, 0.01), 0.0, 1.0);
                collect(&front, &seen, x, p, h, 0.0, regions[r].absorption * (n * share));
                x += p * h;
                if (front.opaque || clip_region(u32(r), x, p).y <= h) {
                    break;
                }
            }
            from_t = max(clip_region(u32(r), x, p).y, 0.0) + 1e-4 * h;
            continue;
        }
        let enters = next.side > 0.0;
        let beyond = ruling_behind(next.region, enters, x, p);
        let m = normalize(level(u32(next.region), x).xyz);
        let a = dot(p, m);
        let w_before = field_of(within, x).w;
        let w_after = field_of(beyond, x).w;
        let square = a * a + 2.0 * (w_after - w_before);
        if (square <= 0.0) {
            p -= 2.0 * a * m;
            continue;
        }
        let s = sqrt(square);
        if (within < 0 && beyond >= 0 && mirror.share == 0.0) {
            mirror = Mirror(seen.colour, front.transmittance, vec3<f32>(0.0), 0.0);
            mirror.share = regions[next.region].strength * reflectance(abs(a), s, w_before, w_after);
            if (mirror.share > 0.0) {
                mirror.light = mirrored(x, normalize(p - 2.0 * a * m));
            }
        }
        p += (select(-s, s, a > 0.0) - a) * m;
        within = beyond;
    }
    let direction_out = normalize(p);
    let whole = seen.colour + front.transmittance * behind(seen, direction_out);
    if (mirror.share <= 0.0) {
        return whole;
    }
    let rest = max(whole - mirror.colour, vec3<f32>(0.0)) / max(mirror.before, 1e-4);
    return mirror.colour + mirror.before * code(mix(light(rest), light(mirror.light), mirror.share));
}

@vertex
fn corner(@builtin(vertex_index) k: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(f32(k & 1u) * 4.0 - 1.0, f32(k >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn pixel(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let d = normalize(view.forward + (at.x - 0.5 * view.width) * view.right + (at.y - 0.5 * view.height) * view.down);
    return vec4<f32>(clamp(radiance(view.eye, d), vec3<f32>(0.0), vec3<f32>(1.0)), 1.0);
}
`,G=`// What the renderer of a shared page reads: the scene as \`verbs/export/html\` of the program writes it.

// How the picture is made. The fields are those of \`View\` in renderer.ts.
struct View {
    eye: vec3<f32>,
    regions: u32,
    // Axes of the camera, of the length of a pixel at distance 1.
    right: vec3<f32>,
    width: f32,
    down: vec3<f32>,
    height: f32,
    forward: vec3<f32>,
    straight: u32,
}

// A refractive region. The fields are those of \`region\` in verbs/export/html/regions.rs.
struct Region {
    lowest: vec3<f32>,
    // The index of a body that has one.
    index: f32,
    nodes_per_unit: vec3<f32>,
    // Longest step in t.
    step: f32,
    absorption: vec3<f32>,
    // Share of Fresnel's reflectance that is seen.
    strength: f32,
    nodes: vec3<u32>,
    // Bits: IS_BODY, IS_UNIFORM, IS_OF_PLANES.
    kind: u32,
    field_lowest: vec3<f32>,
    // Factor on n - 1 of a field.
    contrast: f32,
    field_nodes_per_unit: vec3<f32>,
    // Largest index of the field.
    largest: f32,
    field_nodes: vec3<u32>,
    // Where coefficients and distances lie: of the level set, of the field, and in bytes of the cells without surface.
    surface: u32,
    field: u32,
    clearance: u32,
    // How many planes enclose the body or cut its level set, and where the first of them lies.
    planes: u32,
    first_plane: u32,
}

const IS_BODY: u32 = 1u;
const IS_UNIFORM: u32 = 2u;
const IS_OF_PLANES: u32 = 4u;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> scene: Scene;
@group(0) @binding(2) var<uniform> task: Task;
@group(0) @binding(3) var<uniform> regions: array<Region, MOST_REGIONS>;
@group(0) @binding(4) var<storage, read> table: array<i32>;
@group(0) @binding(5) var<storage, read> forward: array<u32>;
@group(0) @binding(6) var<storage, read> occupied: array<u32>;
@group(0) @binding(7) var<storage, read> density: array<f32>;
@group(0) @binding(8) var<storage, read> colours: array<u32>;
@group(0) @binding(9) var<storage, read> texels: array<f32>;
// Scales of colours, planes, then coefficients of level sets and fields.
@group(0) @binding(10) var<storage, read> numbers: array<f32>;
@group(0) @binding(11) var<storage, read> clearances: array<u32>;

// Four coefficients of colour of a voxel.
fn colour_at(voxel: u32, block: u32) -> vec4<f32> {
    let at = 4u * block;
    let scale = vec4<f32>(numbers[at], numbers[at + 1u], numbers[at + 2u], numbers[at + 3u]);
    return unpack4x8snorm(colours[voxel * BLOCKS + block]) * scale;
}
`,K=`// The finished picture, stretched over the canvas.

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var linear: sampler;

struct Corner {
    @builtin(position) at: vec4<f32>,
    @location(0) place: vec2<f32>,
}

@vertex
fn corner(@builtin(vertex_index) k: u32) -> Corner {
    let place = vec2<f32>(f32(k & 1u) * 2.0, f32(k >> 1u) * 2.0);
    return Corner(vec4<f32>(place.x * 2.0 - 1.0, 1.0 - place.y * 2.0, 0.0, 1.0), place);
}

@fragment
fn pixel(in: Corner) -> @location(0) vec4<f32> {
    return textureSample(picture, linear, in.place);
}
`,q=`// Cubic B-splines on the nodes of a box, theory (2.5): level sets, with the planes that cut them, and the fields w = n²/2.

struct Weights {
    value: vec4<f32>,
    slope: vec4<f32>,
}

fn spline_weights(f: f32) -> Weights {
    let g = 1.0 - f;
    return Weights(
        vec4<f32>(g * g * g, 4.0 - 6.0 * f * f + 3.0 * f * f * f, 4.0 - 6.0 * g * g + 3.0 * g * g * g, f * f * f) / 6.0,
        vec4<f32>(-0.5 * g * g, (1.5 * f - 2.0) * f, -(1.5 * g - 2.0) * g, 0.5 * f * f),
    );
}

// Value and, in the first three, gradient [1 / node] at node coordinates inside the grid.
fn spline(first: u32, nodes: vec3<u32>, at: vec3<f32>) -> vec4<f32> {
    let cell = clamp(vec3<i32>(floor(at)), vec3<i32>(1), vec3<i32>(nodes) - 3);
    let f = at - vec3<f32>(cell);
    let x = spline_weights(f.x);
    let y = spline_weights(f.y);
    let z = spline_weights(f.z);
    let base = vec3<u32>(cell - 1);
    var sum = vec4<f32>(0.0);
    for (var k = 0u; k < 4u; k++) {
        for (var j = 0u; j < 4u; j++) {
            let row = first + base.x + nodes.x * (base.y + j + nodes.y * (base.z + k));
            let c = vec4<f32>(numbers[row], numbers[row + 1u], numbers[row + 2u], numbers[row + 3u]);
            let value = dot(x.value, c);
            sum += vec4<f32>(
                dot(x.slope, c) * y.value[j] * z.value[k], value * y.slope[j] * z.value[k],
                value * y.value[j] * z.slope[k], value * y.value[j] * z.value[k],
            );
        }
    }
    return sum;
}

// (m, h) of a plane of a body: its height at node coordinates g is h + m·g, theory (4.14).
fn plane_of(r: u32, k: u32) -> vec4<f32> {
    let at = regions[r].first_plane + 4u * k;
    return vec4<f32>(numbers[at], numbers[at + 1u], numbers[at + 2u], numbers[at + 3u]);
}

// Gradient [1] and value φ of a body [scene unit]: of its level set, or of the highest of its planes where that is higher.
fn level(r: u32, x: vec3<f32>) -> vec4<f32> {
    if (regions[r].planes == 0u) {
        return level_of_spline(r, x);
    }
    let at = (x - regions[r].lowest) * regions[r].nodes_per_unit;
    var highest = vec4<f32>(0.0, 0.0, 0.0, -FAR);
    for (var k = 0u; k < regions[r].planes; k++) {
        let plane = plane_of(r, k);
        let height = plane.w + dot(plane.xyz, at);
        if (height > highest.w) {
            highest = vec4<f32>(plane.xyz * regions[r].nodes_per_unit, height);
        }
    }
    if ((regions[r].kind & IS_OF_PLANES) != 0u) {
        return highest;
    }
    let spline = level_of_spline(r, x);
    return select(spline, highest, highest.w > spline.w);
}

// The same of its level set, whatever planes there are; outside its box far from it.
fn level_of_spline(r: u32, x: vec3<f32>) -> vec4<f32> {
    let at = (x - regions[r].lowest) * regions[r].nodes_per_unit;
    let last = vec3<f32>(regions[r].nodes - 1u);
    if (any(at < vec3<f32>(1.0)) || any(at > last - 1.0)) {
        return vec4<f32>(0.0, 0.0, 0.0, 1.0);
    }
    let s = spline(regions[r].surface, regions[r].nodes, at);
    return vec4<f32>(s.xyz * regions[r].nodes_per_unit, s.w);
}

// Gradient and value of w = n²/2 of a region; −1 is vacuum.
fn field_of(r: i32, x: vec3<f32>) -> vec4<f32> {
    if (r < 0) {
        return vec4<f32>(0.0, 0.0, 0.0, 0.5);
    }
    let k = u32(r);
    if ((regions[k].kind & IS_UNIFORM) != 0u) {
        return vec4<f32>(0.0, 0.0, 0.0, 0.5 * regions[k].index * regions[k].index);
    }
    let at = (x - regions[k].field_lowest) * regions[k].field_nodes_per_unit;
    let last = vec3<f32>(regions[k].field_nodes - 1u);
    let is_rim = any(at < vec3<f32>(1.0)) || any(at > last - 1.0);
    if (is_rim && (regions[k].kind & IS_BODY) == 0u) {
        return vec4<f32>(0.0, 0.0, 0.0, 0.5);
    }
    let s = spline(regions[k].field, regions[k].field_nodes, at);
    // n − 1 times the contrast.
    let n = sqrt(2.0 * s.w);
    let m = 1.0 + regions[k].contrast * (n - 1.0);
    return vec4<f32>(s.xyz * regions[k].field_nodes_per_unit * (regions[k].contrast * m / n), 0.5 * m * m);
}
`;async function J(){let e=JSON.parse(document.querySelector(`#document`).textContent),t=document.querySelector(`#numbers`).textContent.trim(),n=atob(t),r=new Uint8Array(n.length);for(let e=0;e<n.length;e++)r[e]=n.charCodeAt(e);let i=new Blob([r]).stream().pipeThrough(new DecompressionStream(`gzip`));return{document:e,bytes:await new Response(i).arrayBuffer()}}function Y(e,{at:t,length:n,low:r,step:i}){let a=new Uint16Array(e,t,n/2);return Float32Array.from(a,e=>r+i*e)}var ae=30,[oe,se,X]=[3,19,32];function ce({constants:{u32:e,f32:t}}){let n=Object.entries(e).map(([e,t])=>`const ${e}: u32 = ${t}u;`),r=Object.entries(t).map(([e,t])=>`const ${e}: f32 = ${Number.isInteger(t)&&Math.abs(t)<1e6?t.toFixed(1):t}f;`);return[...n,...r].join(`
`)}var Z=class e{device;canvas;scene;view;regions;media;paint;group;blit;sampler;context;target=null;rows=16;speed=200;lost;isLost=!1;constructor(e,t,n,r){this.device=e,this.canvas=t,this.scene=n,this.lost=e.lost.then(({message:e,reason:t})=>(this.isLost=!0,e||t));let{document:i,bytes:a}=n,o=(t,n)=>{let r=Math.max(16,Math.ceil(t.byteLength/4)*4),i=e.createBuffer({size:r,usage:n|GPUBufferUsage.COPY_DST});return e.queue.writeBuffer(i,0,t),i},s=e=>new Uint8Array(a,i.parts[e].at,4*Math.ceil(i.parts[e].length/4)),{UNIFORM:c,STORAGE:l}=GPUBufferUsage;this.view=e.createBuffer({size:64,usage:c|GPUBufferUsage.COPY_DST}),this.media=new Uint8Array(s(`regions`)).buffer,this.regions=o(this.media,c);let u=e=>new Float32Array(a,e.byteOffset,e.byteLength/4),d=[u(s(`scales`)),u(s(`planes`)),...i.splines.map(e=>Y(a,e))],f=new Float32Array(d.reduce((e,t)=>e+t.length,0)),p=0;for(let e of d)f.set(e,p),p+=e.length;let m=[this.view,o(s(`scene`),c),o(s(`task`),c),this.regions,o(s(`table`),l),o(s(`forward`),l),o(s(`occupied`),l),o(Y(a,i.density),l),o(s(`colours`),l),o(s(`texels`),l),o(f,l),o(s(`clearances`),l)],h=e.createShaderModule({code:r}),g=e=>e<4?`uniform`:`read-only-storage`,_=e.createBindGroupLayout({entries:m.map((e,t)=>({binding:t,visibility:GPUShaderStage.FRAGMENT,buffer:{type:g(t)}}))});this.group=e.createBindGroup({layout:_,entries:m.map((e,t)=>({binding:t,resource:{buffer:e}}))}),this.paint=e.createRenderPipeline({layout:e.createPipelineLayout({bindGroupLayouts:[_]}),vertex:{module:h},fragment:{module:h,targets:[{format:`rgba8unorm`}]}});let v=navigator.gpu.getPreferredCanvasFormat(),y=e.createShaderModule({code:K});this.blit=e.createRenderPipeline({layout:`auto`,vertex:{module:y},fragment:{module:y,targets:[{format:v}]}}),this.sampler=e.createSampler({magFilter:`linear`,minFilter:`linear`}),this.context=t.getContext(`webgpu`),this.context.configure({device:e,format:v,alphaMode:`opaque`})}static async make(t,n){if(!(`gpu`in navigator))throw Error(`this browser has no WebGPU`);let r=await navigator.gpu.requestAdapter({powerPreference:`high-performance`});if(!r)throw Error(`WebGPU finds no graphics device here`);let{maxStorageBufferBindingSize:i,maxBufferSize:a}=r.limits,o=await r.requestDevice({requiredLimits:{maxStorageBufferBindingSize:i,maxBufferSize:a}}),s=[ce(n.document),V,G,z,I,U,H,R,F,L,B,q,ie,W].join(`
`);o.pushErrorScope(`validation`),o.pushErrorScope(`out-of-memory`);let c=new e(o,t,n,s),l=[await o.popErrorScope(),await o.popErrorScope()].find(e=>e!==null);if(l)throw Error(l.message);return c}async render(e,t,n){let[r,i]=e.size;if(this.tell(e,t),this.target?.width!==r||this.target.height!==i){this.target?.destroy();let e=GPUTextureUsage.RENDER_ATTACHMENT|GPUTextureUsage.TEXTURE_BINDING|GPUTextureUsage.COPY_SRC;this.target=this.device.createTexture({size:[r,i],format:`rgba8unorm`,usage:e})}let a=this.target.createView();for(let e=0;e<i;){let t=Math.min(this.rows,i-e),o=performance.now(),s=this.device.createCommandEncoder(),c=s.beginRenderPass({colorAttachments:[{view:a,loadOp:`load`,storeOp:`store`}]});c.setPipeline(this.paint),c.setBindGroup(0,this.group),c.setScissorRect(0,e,r,t),c.draw(3),c.end(),this.device.queue.submit([s.finish()]),await this.device.queue.onSubmittedWorkDone();let l=Math.max(.2,performance.now()-o);if(this.speed+=.3*(t*r/l-this.speed),this.rows=Math.max(4,Math.min(4096,Math.round(this.speed*ae/r))),e+=t,this.isLost||n())return!1}return this.show(),!0}tell({eye:e,axes:t,angle:r,size:i},{index:a,straight:o}){let s=2*Math.tan(.5*r)/i[0],[c,l,u]=t,d=new ArrayBuffer(64),[f,p]=[new Float32Array(d),new Uint32Array(d)];f.set([...e,0,...n(c,s),i[0],...n(l,s),i[1],...u,0]),p[3]=this.scene.document.regions.length,p[15]=+!!o,this.device.queue.writeBuffer(this.view,0,d);let m=new Float32Array(this.media.slice(0));this.scene.document.regions.forEach((e,t)=>{e.slides&&(e.uniform?m[X*t+oe]=a[t]:m[X*t+se]=(a[t]-1)/(e.index-1))}),this.device.queue.writeBuffer(this.regions,0,m)}show(){let e=this.device.createCommandEncoder(),t=this.context.getCurrentTexture().createView(),n=this.device.createBindGroup({layout:this.blit.getBindGroupLayout(0),entries:[{binding:0,resource:this.target.createView()},{binding:1,resource:this.sampler}]}),r=e.beginRenderPass({colorAttachments:[{view:t,loadOp:`clear`,storeOp:`store`}]});r.setPipeline(this.blit),r.setBindGroup(0,n),r.draw(3),r.end(),this.device.queue.submit([e.finish()])}resize(e,t){(this.canvas.width!==e||this.canvas.height!==t)&&([this.canvas.width,this.canvas.height]=[e,t])}},[le,ue]=[50,150],de=1600,fe=`(max-width: 700px)`,pe=[[`air`,1],[`water`,1.33],[`glass`,1.5],[`diamond`,2.42]],me=class{doc;make;stage=document.querySelector(`#stage`);camera=new m;index;renderer=null;straight=!1;wanted=0;busy=!1;moving=!1;rest=0;constructor(e,t){this.doc=e,this.make=t,this.index=e.regions.map(e=>e.index),this.camera.up=e.up,this.camera.stayNear(e.min,e.max,e.start.eye),this.home(),M(this.stage,this.camera,{moved:()=>this.changed(!0),click:()=>{},center:()=>{}}),new ResizeObserver(()=>this.changed(!1)).observe(this.stage),addEventListener(`keydown`,e=>!w(e)&&T(e)===`R`&&this.home())}async begin(){Q(`The scene is made ready.`);let e=await this.make();this.renderer=e,document.querySelector(`#panel`).hidden&&this.controls(),Q(null),e.lost.then(e=>this.lose(e)),this.changed(!1)}lose(e){this.renderer=null,document.querySelector(`#still`).hidden=!1,Q(`The graphics device has gone: ${e.replace(/\.$/,``)}. This is a picture until another one is there.`,_(`Start again`,`Asks for a graphics device`,()=>this.begin().catch(e=>this.lose($(e)))))}home(){this.camera.take(this.doc.start,s(this.doc.min,this.doc.max,.5)),this.changed(!1)}controls(){let e=document.querySelector(`#panel`);e.hidden=!1,e.open=!matchMedia(fe).matches;let t=document.querySelector(`#controls`),n=this.doc.regions.flatMap((e,t)=>{if(!e.slides)return[];let n=new ee(this.doc.regions.length>1?`index of region ${t+1}`:`index of refraction`,[1,2.5,.005],e=>e.toFixed(3),e=>{this.index[t]=e,this.changed(!0)});return n.set(e.index),[{slider:n,k:t}]}),r=e=>{for(let{slider:t,k:r}of n)this.index[r]=e??this.doc.regions[r].index,t.set(this.index[r]);this.changed(!1)};if(n.length>0){let e=[...pe,[`as learned`,null]];t.append(...n.map(e=>e.slider.element),g(`div`,{class:`row`},...e.map(([e,t])=>_(e,t===null?`As the run has found it`:`n = ${t}`,()=>r(t))))),t.append(v(`straight rays`,`As if nothing bent them`,e=>{this.straight=e,this.changed(!1)})[0])}t.append(g(`p`,{},`Drag to turn, wheel to come nearer, right drag or two fingers to move, W A S D Q E to fly, R to go back.`))}changed(e){clearTimeout(this.rest),this.wanted++,this.moving=e,e&&(this.rest=setTimeout(()=>this.changed(!1),ue)),!this.busy&&this.renderer&&(this.busy=!0,requestAnimationFrame(()=>void this.paint(this.renderer)))}async paint(e){if(this.busy=e!==null,!e)return;let t=this.wanted,{moving:n}=this,r=Math.min(devicePixelRatio,2),i=[this.stage.clientWidth*r,this.stage.clientHeight*r],a=Math.min(1,de/Math.max(...i)),o=i[0]*i[1]*a*a,s=n?Math.min(1,Math.sqrt(e.speed*le/o)):1,c=e=>Math.max(16,Math.round(e*a*s));e.resize(Math.max(16,Math.round(i[0])),Math.max(16,Math.round(i[1])));let l=this.camera.for([c(i[0]),c(i[1])]),u={index:this.index,straight:this.straight},d=performance.now();await e.render(l,u,()=>!n&&this.wanted!==t)&&(document.querySelector(`#still`).hidden=!0,Object.assign(document.body.dataset,{picture:String(t),full:String(!n),ms:(performance.now()-d).toFixed(0)})),this.busy=this.wanted!==t,this.busy&&requestAnimationFrame(()=>void this.paint(this.renderer))}};function Q(e,t){let n=document.querySelector(`#note`);n.hidden=e===null,n.replaceChildren(e??``,...t?[` `,t]:[])}var $=e=>e instanceof Error?e.message:String(e);async function he(){try{let e=document.querySelector(`#lines`),t=await J();await new me(t.document,()=>Z.make(e,t)).begin()}catch(e){let t=$(e);Q(`This is a picture: ${t}. A recent Chrome, Edge, Safari or Firefox with WebGPU shows the scene itself, to turn and to change.`),document.body.dataset.failed=t}}he();