// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include "recon/synthetic/flame_simulation.h"
using namespace emberlock; using namespace emberlock::recon;
int main(int c,char**v){ int n=c>2?atoi(v[2]):48; auto o=flame_preset(*parse_flame_preset(v[1]),n); if(c>5) o.nz=atoi(v[5]); o.compute={Device::cpu,c>6?atoi(v[6]):2};
 auto s=FlameSimulation::make(o); if(!s.ok()){puts(s.error().message().c_str());return 1;}
 int steps=atoi(v[3]); double dt=atof(v[4]);
 for(int i=0;i<steps;++i){auto t0=std::chrono::steady_clock::now(); auto r=s->step(Seconds(dt)); if(!r.ok()){puts(r.error().message().c_str());return 1;}
  double w=std::chrono::duration<double>(std::chrono::steady_clock::now()-t0).count();
  if(i%(steps/20+1)==0){ auto st=s->state(); float k=0; for(float a:st.absorption) k=a>k?a:k; 
  // flame height: highest with T>1000
  int top=0; for(size_t q=0;q<st.temperature.size();++q) if(st.temperature[q]>1000) top=int(q)/(st.grid.nx*st.grid.ny);
  printf("t %.3f sub %d it %d div %.1e cfl %.2f v %.2f T %.0f Q %.4g W kmax %.3g top %.3f m  %.3f s/substep\n",s->time().value(),r->substeps,r->iterations,r->relative_divergence,r->cfl,r->fastest,r->hottest.value(),r->heat_release,k,float(top)*st.grid.edge,w/(r->substeps>0?r->substeps:1)); fflush(stdout);} }
}
