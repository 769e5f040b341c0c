use tongue_fit::equilibrium::*; use tongue_fit::mesh::{self,Anatomy}; use tongue_fit::system::*;
fn main(){ let mesh = mesh::build(&Anatomy::reference().unwrap(), mesh::DEFAULT_SPACING_M).unwrap();
 let s=System::new(&mesh,&Model::default(),&[0,4,6]).unwrap(); let mut w=Workspace::new(&s); run(&s,&mut w); }
#[inline(never)] pub fn run(s:&System<2>, w:&mut Workspace<2>){ for _ in 0..50 { w.start_from_rest(s);
 let r=solve(s,w,&[12.0,0.,0.,0.,11.5,0.,4.5,0.],&Settings::default()); std::hint::black_box(r); }
 let r=solve(s,w,&[12.3,0.,0.,0.,11.3,0.,4.7,0.],&Settings::default()); println!("{r:?} {:?}", w.positions()[20]); }
